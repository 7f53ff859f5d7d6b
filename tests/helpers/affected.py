"""Finds the tests that a change concerns, by what files import.

A test file is concerned if it changed, or if it reaches a changed module: by
any number of imports in the folder of the tests of the module's package,
elsewhere by two at most. A member of a family, which nothing imports, concerns
that whole folder, and so does what its tests reach through members alone. A
page concerns `tests/documents`, and other files what names them.
"""

import ast
from collections.abc import Iterable
import functools
import itertools
from pathlib import Path
import subprocess

ROOT = Path(__file__).resolve().parents[2]
# Imports from a test of another package to a changed module, at most.
_FAR = 2


@functools.cache
def changed_files(base: str) -> frozenset[str]:
    """Returns the files that differ from a commit, relative to the root."""
    found = set()
    for command in (
        ("diff", "--name-only", "--merge-base", base),
        ("ls-files", "--others", "--exclude-standard"),
    ):
        lines = subprocess.run(
            ["git", *command], cwd=ROOT, check=True, capture_output=True
        ).stdout
        found.update(lines.decode().splitlines())
    return frozenset(found)


def concerns(test: str, changed: Iterable[str]) -> bool:
    """Returns whether a change of files concerns a test file."""
    modules, near = set(), set()
    for file in changed:
        if file.endswith(".md") and test.startswith("tests/documents/"):
            return True
        if not file.endswith((".py", ".pyi", ".md")):
            if Path(file).name in _text(test):
                return True
        elif file.endswith(".py"):
            modules.add(file)
            folder = _folder_of_tests(file)
            if test.startswith(folder):
                near.add(file)
                if file not in _imported_anywhere() & _reached_from(folder):
                    return True
    return any(
        layer & (modules if steps <= _FAR else near)
        for steps, layer in enumerate(_layers(test))
    )


def needs_simulator(test: str) -> bool:
    """Returns whether a test file imports more of ours than `evaluation`."""
    houses = ("cns_drake/", "worlds/", "diagrams/")
    return any(
        file.startswith(houses) for layer in _layers(test) for file in layer
    )


@functools.cache
def _layers(test: str) -> list[set[str]]:
    """Returns the files that a test reaches by 0, 1, 2, ... imports."""
    layers = [{test}]
    while layers[-1]:
        found = set().union(*map(imported_files, layers[-1]))
        layers.append(found.difference(*layers))
    return layers


@functools.cache
def _reached_from(folder: str) -> frozenset[str]:
    """Returns the files that the tests in a folder reach."""
    tests = (ROOT / folder).rglob("test_*.py")
    reached = (_layers(str(test.relative_to(ROOT))) for test in tests)
    return frozenset().union(*itertools.chain.from_iterable(reached))


@functools.cache
def _folder_of_tests(file: str) -> str:
    """Returns the folder of the tests of a module, or of its outer package."""
    folder = Path("tests", file).parent
    while not (ROOT / folder).is_dir():
        folder = folder.parent
    return f"{folder}/"


@functools.cache
def _imported_anywhere() -> frozenset[str]:
    """Returns the files of the packages that one of them imports."""
    files = itertools.chain.from_iterable(
        (ROOT / package).rglob("*.py")
        for package in ("cns_drake", "evaluation", "worlds")
    )
    names = (str(file.relative_to(ROOT)) for file in files)
    return frozenset().union(*map(imported_files, names))


@functools.cache
def imported_files(file: str) -> frozenset[str]:
    """Returns the files of this repository that a file imports."""
    found = set()
    for node in ast.walk(ast.parse(_text(file))):
        if isinstance(node, ast.Import):
            found |= {_file_of(one.name) for one in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            for one in node.names:
                found.add(_file_of(f"{node.module}.{one.name}"))
                found.add(_file_of(_home(node.module, one.name)))
    return frozenset(found - {""})


def _home(module: str, name: str) -> str:
    """Returns the module that a name comes from, through doors of doors."""
    doors = _doors(module)
    return _home(doors[name], name) if name in doors else module


@functools.cache
def _doors(package: str) -> dict[str, str]:
    """Returns name -> module, for the public names of a package."""
    stub = f"{package.replace('.', '/')}/__init__.pyi"
    if not (ROOT / stub).is_file():
        return {}
    return {
        alias.asname or alias.name: f"{package}.{node.module}"
        for node in ast.parse(_text(stub)).body
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }


@functools.cache
def _file_of(module: str) -> str:
    """Returns the file of a module; "" if it is not of this repository."""
    place = module.replace(".", "/")
    for file in (f"{place}.py", f"tests/{place}.py", f"{place}/__init__.py"):
        if (ROOT / file).is_file():
            return file
    return ""


@functools.cache
def _text(file: str) -> str:
    return (ROOT / file).read_text(encoding="utf-8")
