"""The empirical model of response (EMoR): principal components of measured cameras."""

from dataclasses import dataclass
from typing import ClassVar, final

from typing_extensions import override

from chartless.models._base import Property, register_model
from chartless.models._principal import N_COMPONENTS, PrincipalModel


@final
@dataclass(frozen=True, slots=True)
class Emor(PrincipalModel):
    """EMoR of order N: the mean of measured responses and N + 1 principal components.

    Grossberg and Nayar, *Modeling the space of camera response functions* (TPAMI 2004),
    section 4. Not every member increases; `EmorMonotone` holds those that do.
    """

    family: ClassVar[str] = "emor"
    formula: ClassVar[str] = "f0 + c1 h1 + ... + cM hM, h from measured responses"

    @property
    @override
    def properties(self) -> frozenset[Property]:
        return frozenset({Property.ENDS, Property.EXTENSIBLE, Property.COMPACT})


register_model(*(Emor(order) for order in range(N_COMPONENTS)))
