"""Packages are imported through their doors, and doors offer what they list."""

import ast
from collections import defaultdict
import functools
import importlib
from pathlib import Path
import re
import subprocess
import sys

from helpers.door_contract import (
    ROOTS,
    inner_imports,
    listed,
    offered_modules,
    package_of,
)
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


@functools.cache
def users():
    """Returns (package, name) -> who imports the name: packages and folders."""
    found = defaultdict(set)
    for path in (*ROOT.rglob("*/*.py"), *ROOT.glob("*/__init__.pyi")):
        place = path.relative_to(ROOT)
        if place.parts[0] not in (*ROOTS, "diagrams", "docs", "tests"):
            continue
        module = ".".join(place.with_suffix("").parts)
        user = package_of(module) or place.parts[0]
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                home = node.module or ""
                # Of names that a whole house offers.
                home = f"{place.parts[0]}.{home}" if node.level else home
                for alias in node.names:
                    found[home, alias.name].add(user)
    return found


@pytest.mark.parametrize("package", DOORS)
def test_a_door_offers_what_somebody_uses(package):
    house, _, name = package.partition(".")
    as_a_whole = users()[house, name]
    taken = {n: users()[package, n] | as_a_whole for n in listed(package)}
    assert [n for n, some in taken.items() if not some - {package}] == []


def test_base_holds_what_several_packages_use():
    base = "evaluation.base"
    modules = defaultdict(set)
    for name, home in listed(base).items():
        module = home if home != base else f"{base}.{name}"
        modules[module] |= users()[base, name]
        modules[module] |= {
            user
            for (place, _), some in users().items()
            if place == module
            for user in some
        }
    assert modules
    for module, some in modules.items():
        assert len(some - {"tests", "docs"}) > 1, module


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
@pytest.mark.parametrize("package", [*ROOTS, *DOORS])
def test_a_door_loads_nothing_before_a_name_is_used(package):
    code = f"import {package}, sys; print(*sys.modules)"
    loaded = subprocess.check_output(
        [sys.executable, "-c", code], cwd=ROOT, text=True
    ).split()
    ours = {name for name in loaded if name.split(".")[0] in ROOTS}
    inside = {name for name in ours if name.startswith(f"{package}.")}
    assert inside == set()
    assert {"numpy", "pydrake", "pydantic", "typer"}.isdisjoint(loaded)
