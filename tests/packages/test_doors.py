"""Packages are imported through their doors, and doors offer what they list."""

import importlib
from pathlib import Path
import re
import subprocess
import sys

from helpers.door_contract import ROOTS, inner_imports, listed, offered_modules
import pytest

ROOT = Path(__file__).parents[2]
DOORS = sorted(
    ".".join(path.parent.relative_to(ROOT).parts)
    for root in ROOTS
    for path in (ROOT / root).glob("*/__init__.py")
)
OUTSIDE = sorted(
    path
    for folder in ("tests", "docs", "diagrams")
    for path in (ROOT / folder).rglob("*.py")
    if "internal" not in path.relative_to(ROOT).parts
)


@pytest.mark.parametrize("package", [*ROOTS, *DOORS])
def test_a_door_offers_what_its_stub_lists(package):
    door = importlib.import_module(package)
    modules = offered_modules(package)
    assert dir(door) == sorted(door.__all__) == sorted(listed(package))
    for name, home in listed(package).items():
        if f"{package}.{name}" in modules:
            assert getattr(door, name).__name__ == f"{package}.{name}"
        else:
            assert getattr(door, name) is getattr(
                importlib.import_module(home), name
            )


@pytest.mark.parametrize("package", DOORS)
def test_a_door_says_why_the_package_ends_there(package):
    """CONTRIBUTING.md has the three reasons."""
    first, _, _ = importlib.import_module(package).__doc__.partition("\n")
    assert re.search(r"\ba (wall|family)\b|\b(a )?public nouns?\b", first)


@pytest.mark.parametrize("package", DOORS)
def test_no_module_takes_the_place_of_a_name(package):
    # Once imported, a module is an attribute of its package.
    folder = ROOT / package.replace(".", "/")
    inside = {path.stem for path in folder.iterdir()}
    taken = {
        name
        for name in listed(package)
        if name in inside
        and f"{package}.{name}" not in offered_modules(package)
    }
    assert taken == set()


@pytest.mark.parametrize(
    "path", OUTSIDE, ids=lambda path: str(path.relative_to(ROOT))
)
def test_who_is_outside_uses_doors(path):
    assert list(inner_imports(path.read_text())) == []


def test_imports_behind_a_door_are_noticed():
    code = """
import evaluation.base.units
from evaluation.base.units import wrapped
def late():
    from evaluation.methods import registry
"""
    assert list(inner_imports(code)) == [
        "evaluation.base.units",
        "evaluation.base.units",
        "evaluation.methods.registry",
    ]
    fine = "from evaluation.base import poses, wrapped\nimport evaluation\n"
    assert list(inner_imports(fine)) == []


@pytest.mark.slow
@pytest.mark.parametrize("package", DOORS)
def test_a_door_loads_nothing_before_a_name_is_used(package):
    code = f"import {package}, sys; print(*sys.modules)"
    loaded = subprocess.check_output(
        [sys.executable, "-c", code], cwd=ROOT, text=True
    ).split()
    ours = {name for name in loaded if name.split(".")[0] in ROOTS}
    inside = {name for name in ours if name.startswith(f"{package}.")}
    assert inside == set()
    assert {"numpy", "pydrake", "pydantic", "typer"}.isdisjoint(loaded)
