"""The contract of import-linter that others import packages by their doors.

A package is a folder directly below a house: `cns_drake`, `evaluation` or
`worlds`. Its door is its `__init__`: the stub `__init__.pyi` lists the names
that others may import. All other modules of the package are its own.
"""

from __future__ import annotations

import ast
import functools
from pathlib import Path
from typing import TYPE_CHECKING

from importlinter import Contract, ContractCheck, output

if TYPE_CHECKING:
    from collections.abc import Iterator

    import grimp

ROOT = Path(__file__).parents[2]
ROOTS = ("cns_drake", "evaluation", "worlds")


def package_of(module: str) -> str | None:
    """Returns the package that a module belongs to, if it is inside of one."""
    parts = module.split(".")
    inside = parts[0] in ROOTS and len(parts) > 2
    return ".".join(parts[:2]) if inside else None


def listed(package: str) -> dict[str, str]:
    """Returns name -> module, or package, of what a package's stub lists."""
    stub = ROOT / package.replace(".", "/") / "__init__.pyi"
    return {
        alias.name: f"{package}.{node.module}" if node.module else package
        for node in ast.parse(stub.read_text()).body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname == alias.name  # Others are no names for type checkers.
    }


@functools.cache
def offered_modules(package: str) -> set[str]:
    """Returns the modules that a package's door offers as a whole."""
    names = listed(package).items()
    return {f"{package}.{name}" for name, home in names if home == package}


def inner_imports(code: str) -> Iterator[str]:
    """Yields the modules behind a door that Python code imports."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            modules = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            home = node.module or ""
            names = [f"{home}.{alias.name}" for alias in node.names]
            modules = [home, *filter(_is_module, names)]
        else:
            continue
        for module in modules:
            package = package_of(module)
            if package and module not in offered_modules(package):
                yield module


def _is_module(name: str) -> bool:
    place = ROOT.joinpath(*name.split("."))
    return place.is_dir() or place.with_suffix(".py").is_file()


class DoorContract(Contract):
    """Modules outside of a package import nothing that is behind its door."""

    type_name = "doors"

    def check(self, graph: grimp.ImportGraph, verbose: bool) -> ContractCheck:
        """Returns the imports that go past a door."""
        past = []
        for module in sorted(graph.modules):
            package = package_of(module)
            if package is None or module in offered_modules(package):
                continue
            past += [
                f"{importer} imports {module}, not its name from {package}"
                for importer in graph.find_modules_that_directly_import(module)
                if importer != package
                and not importer.startswith(f"{package}.")
            ]
        return ContractCheck(kept=not past, metadata={"past": past})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Prints a line for each import that goes past a door."""
        for line in check.metadata["past"]:
            output.print_error(line)
            output.new_line()
