"""Every kind of evidence is a room of its own."""

import ast
from pathlib import Path

import pytest

import chartless.evidence
from chartless.evidence import FOLDERS
from chartless.evidence.options import all_options, options_of
from chartless.evidence.registry import KINDS

HOME = Path(chartless.evidence.__file__).parent


def imported(path: Path) -> set[str]:
    """Names of the modules that a file imports."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are absolute"
            found.add(node.module or "")
    return found


def test_every_folder_is_a_kind() -> None:
    folders = {path.parent.name for path in HOME.glob("*/__init__.py")}

    assert folders == set(FOLDERS)
    assert list(KINDS) == list(FOLDERS)


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_kind_imports_nothing_of_another(folder: str) -> None:
    others = [f"chartless.evidence.{name}" for name in FOLDERS if name != folder]
    files = list((HOME / folder).glob("*.py"))

    assert files
    for path in files:
        assert not [name for name in imported(path) if name.startswith(tuple(others))], path


def test_what_serves_all_kinds_imports_none() -> None:
    kinds = tuple(f"chartless.evidence.{name}" for name in FOLDERS)
    for path in HOME.glob("*.py"):
        assert not [name for name in imported(path) if name.startswith(kinds)], path


def test_options_are_of_one_kind_each() -> None:
    names = [name for kind in FOLDERS for name in KINDS[kind].usual]

    assert len(set(names)) == len(names)
    assert list(all_options()) == names
    assert all(options_of(kind) is KINDS[kind].options for kind in FOLDERS)
