"""User-facing names and what they stand for."""

from collections.abc import Iterator, Mapping
from typing import Generic, TypeVar

from chartless.errors import UnknownNameError

T = TypeVar("T")


class Registry(Mapping[str, T], Generic[T]):
    """Mapping from the names users type to the objects they mean, in order of registration.

    Looking up a name nobody registered raises `UnknownNameError`, which lists the
    known names and suggests the closest.

    Parameters
    ----------
    kind : str
        What the names stand for, as an error message would call it.
    """

    def __init__(self, kind: str) -> None:
        self._kind = kind
        self._items: dict[str, T] = {}

    def register(self, name: str, item: T) -> None:
        """Add `item` under `name`; each name can be registered once."""
        if name in self._items:
            msg = f"{self._kind} {name!r} is registered already"
            raise ValueError(msg)
        self._items[name] = item

    def __getitem__(self, name: str) -> T:
        try:
            return self._items[name]
        except KeyError:
            raise UnknownNameError(self._kind, name, self._items) from None

    def __contains__(self, name: object) -> bool:
        return name in self._items

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)
