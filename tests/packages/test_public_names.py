"""What the packages offer by name, and that examples use nothing else."""

import ast
import importlib
import inspect
from pathlib import Path
import re
import subprocess
import sys
import textwrap

from helpers import documents
import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("cns_drake", "evaluation", "worlds")
PUBLIC = {name: importlib.import_module(name).__all__ for name in PACKAGES}
# Modules that are public as a whole.
PUBLIC["evaluation.methods"] = ["Method", "MethodConfig", "register"]
NAMES = [(package, name) for package in PACKAGES for name in PUBLIC[package]]


def private_imports(code):
    """Returns what Python code imports of the packages that is not public."""
    found = []
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            asked = [(alias.name, None) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            asked = [(node.module, alias.name) for alias in node.names]
        else:
            continue
        found += [
            (module, name)
            for module, name in asked
            if module.split(".")[0] in PACKAGES
            and (module, name) != ("evaluation", "drives")
            and name not in PUBLIC.get(module, ())
        ]
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "slow"),
    [
        ("cns_drake.simulation.simulation", {"scipy.stats", "scipy.signal"}),
        (
            "evaluation.recognition.place_measurements",
            {"scipy.stats", "matplotlib"},
        ),
        ("cns_drake.scenarios.drive_table", {"scipy", "numba", "pydrake"}),
    ],
)
def test_programs_load_no_slow_library_that_they_do_not_need(module, slow):
    code = f"import {module}, sys; print(*sys.modules)"
    loaded = subprocess.check_output(
        [sys.executable, "-c", code], cwd=ROOT, text=True
    ).split()
    assert module in loaded
    assert slow.isdisjoint(loaded)


@pytest.mark.parametrize(("package", "name"), NAMES)
def test_public_names_say_how_to_use_them(package, name):
    module = importlib.import_module(package)
    value = getattr(module, name)
    if not (inspect.isclass(value) or inspect.isfunction(value)):
        return
    lines = value.__doc__.splitlines()
    (start,) = (i for i, line in enumerate(lines) if "Example:" in line)
    example = textwrap.dedent("\n".join(lines[start + 1 :]))
    assert re.search("from (cns_drake|evaluation|worlds)", example)
    assert private_imports(example) == []


@pytest.mark.parametrize(
    "path", sorted((ROOT / "diagrams").glob("*.py")), ids=lambda path: path.stem
)
def test_diagrams_use_public_names(path):
    assert private_imports(path.read_text()) == []


def test_the_documents_use_public_names():
    blocks = [
        block.text
        for page in documents.pages()
        for block in documents.fenced(page)
        if block.language == "python"
    ]
    assert blocks
    assert [private_imports(block) for block in blocks] == [[]] * len(blocks)


def test_private_names_are_noticed():
    code = """from cns_drake.sensors.lidar.lidar import Lidar
import evaluation.base.jobs"""
    assert len(private_imports(code)) == 2


def undocumented(owner):
    """Yields public functions and properties of a class without a text."""
    for name, value in vars(owner).items():
        if isinstance(value, property):
            function = value.fget
        else:
            function = getattr(value, "__func__", value)
            function = getattr(function, "func", function)
        inherited = any(
            inspect.getdoc(vars(base)[name])
            for base in owner.__mro__[1:]
            if name in vars(base)
        )
        if (
            inspect.isfunction(function)
            and not name.startswith("_")
            and not inspect.getdoc(function)
            and not inherited
        ):
            yield name


@pytest.mark.parametrize(("package", "name"), NAMES)
def test_what_is_public_has_a_docstring(package, name):
    value = getattr(importlib.import_module(package), name)
    if inspect.isclass(value) or inspect.isfunction(value):
        assert inspect.getdoc(value)
    if inspect.isclass(value):
        assert list(undocumented(value)) == []
