"""Registry of the kinds of evidence, in the order in which they are considered."""

from importlib import import_module
from typing import Any, TypeAlias

from chartless._registry import Registry
from chartless.evidence import FOLDERS
from chartless.evidence.kind import AbstractKind

Kind: TypeAlias = AbstractKind[Any, Any]

KINDS: Registry[Kind] = Registry("kind of evidence")
"""Kinds by the names that users write."""
for folder in FOLDERS:
    KINDS.register(folder, import_module(f"chartless.evidence.{folder}.kind").KIND)
