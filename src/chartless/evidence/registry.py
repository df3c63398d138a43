"""The kinds of evidence that there are, in the order in which they are asked."""

from typing import Any, TypeAlias

from chartless._registry import Registry
from chartless.evidence._kind import AbstractKind
from chartless.evidence.bracket.kind import Bracket
from chartless.evidence.noise.kind import Noise
from chartless.evidence.raw.kind import Raw

Kind: TypeAlias = AbstractKind[Any, Any]

KINDS: Registry[Kind] = Registry("kind of evidence")
"""Kinds by the names that users write."""
for kind in (Raw(), Bracket(), Noise()):
    KINDS.register(kind.name, kind)
