"""Fingerprints: hashes of everything on which a result depends.

Results with equal fingerprints are equal. A fingerprint covers the modules that
the code imports, directly or indirectly, so that changes to other modules leave
results valid. A fingerprint also covers the versions of the libraries that
influence numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
import contextlib
import functools
import hashlib
import importlib.util
import json
from pathlib import Path
import re
from typing import NamedTuple

from cns_drake.base.files import user_errors
from cns_drake.base.version import installed_versions

# The folder of the packages.
_ROOT = Path(__file__).parents[3]
# Names of the packages.
_PACKAGES = ("cns_drake", "evaluation")
# Packages of others that influence numbers.
_LIBRARIES = (
    "drake", "embreex", "numba", "numpy", "open3d", "open3d-cpu", "scipy",
)  # fmt: skip


def fingerprint(inputs: Mapping[str, object]) -> str:
    """Returns a short hash of inputs, which must be JSON values."""
    text = json.dumps(inputs, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


@functools.cache
def code_digest(*modules: str, without: tuple[str, ...] = ()) -> str:
    """Returns a digest of modules and of all project modules they import.

    The digest includes a data file if its name appears in a module of the same
    folder, or if the name of its folder appears in a module next to that
    folder. The digest also includes the versions of libraries.

    Args:
        modules: full names; `<package>.*` stands for all modules in a package.
        without: packages to leave out even if they are imported.
    """
    named: list[_Module] = []
    for name in modules:
        package = name.removesuffix(".*")
        named += (
            [_Module(_ROOT, name)] if package == name else _modules_of(package)
        )
    return _digest(named, without)


def script_digest(path: Path) -> str:
    """Returns a digest of a Python file and everything that it imports.

    The digest covers imported files in the same folder, imported modules of
    this project, and the versions of libraries; see
    `cns_drake.base.jobs.fingerprint.code_digest`.

    Raises:
        InputError: if a file cannot be read.
    """
    return _digest([_Module(path.parent, path.stem)], ())


class _Module(NamedTuple):
    """A module, which may not exist; its name is relative to folder `root`."""

    root: Path
    name: str

    def parents(self) -> Iterator[_Module]:
        """Yields the packages that contain the module."""
        name = self.name
        while name := name.rpartition(".")[0]:
            yield _Module(self.root, name)


class _Imports(NamedTuple):
    """The imports of a module.

    Attributes:
        names: for each import that runs, the module, and the name that is
            imported from it ("" for the module itself).
        offered: maps each name that a package imports on its first use to its
            module, as the stub of the package says.
    """

    names: tuple[tuple[str, str], ...]
    offered: Mapping[str, str]


def _is_ours(name: str) -> bool:
    return name.partition(".")[0] in _PACKAGES


@functools.cache
def _source(module: _Module) -> Path | None:
    """Returns the source of a module; None if there is none."""
    place = module.root.joinpath(*module.name.split("."))
    for path in (place / "__init__.py", Path(f"{place}.py")):
        if path.is_file():
            return path
    return None


def _imported_modules(module: _Module) -> Iterator[_Module]:
    """Yields imported modules of this project, and modules beside a script.

    For a module of this project, modules beside the project are left out: they
    can be any installed packages. Of these packages, only the versions count
    (`_LIBRARIES`).
    """
    for home, name in _imports_of(module).names:
        own = _is_ours(home)
        if not own and module.root == _ROOT and _is_ours(module.name):
            continue
        package = _Module(_ROOT if own else module.root, home)
        yield package
        inner = package._replace(name=f"{home}.{name}")
        if name and _source(inner) is not None:
            yield inner
            continue
        # A package may offer what another package offers.
        while name in (offered := _imports_of(package).offered):
            package = package._replace(name=offered[name])
            yield package


@functools.cache
def _imports_of(module: _Module) -> _Imports:
    path = _source(module)
    if path is None:
        return _Imports((), {})
    package = module.name
    if path.name != "__init__.py":
        package = package.rpartition(".")[0]
    stub = path.with_name("__init__.pyi")
    offered: dict[str, str] = {}
    with user_errors(path):
        names = _find_imports(path.read_bytes(), package)
        if path.name == "__init__.py" and stub.is_file():
            text = stub.read_bytes()
            offered = {
                name: home for home, name in _find_imports(text, package)
            }
    return _Imports(names, offered)


def _modules_of(package: str) -> Iterator[_Module]:
    """Yields all modules of a package, with those of its subpackages."""
    for path in _ROOT.joinpath(*package.split(".")).rglob("*.py"):
        parts = path.relative_to(_ROOT).with_suffix("").parts
        yield _Module(_ROOT, ".".join(parts).removesuffix(".__init__"))


def _digest(modules: Iterable[_Module], without: tuple[str, ...]) -> str:
    for read in (_source, _imports_of):  # Files may have changed.
        read.cache_clear()
    total = hashlib.sha256(repr(installed_versions(_LIBRARIES)).encode())
    for name, path in sorted(_source_files(modules, without).items()):
        total.update(f"{name}\n".encode())
        with user_errors(path):
            # Line ends may differ between the machines of a cluster.
            total.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return total.hexdigest()[:32]


def _source_files(
    modules: Iterable[_Module], without: tuple[str, ...]
) -> dict[str, Path]:
    """Returns name -> path of the files that modules consist of."""
    waiting = list(modules)
    done: set[_Module] = set()
    found: dict[str, Path] = {}
    while waiting:
        module = waiting.pop()
        path = _source(module)
        if module in done or path is None:
            continue
        if f"{module.name}.".startswith(tuple(f"{name}." for name in without)):
            continue
        done.add(module)
        if module.root == _ROOT:
            for file in _data_files(path):
                found[file.relative_to(_ROOT).as_posix()] = file
        # Its parent packages run, too; their data do not count.
        for package in (module, *module.parents()):
            source = _source(package)
            if source is not None:
                found[f"{package.name}.py"] = source
                waiting += _imported_modules(package)
    return found


# Python's own parser would take a second for the modules of a simulation, and
# most of it for what is no import.
_TEXTS_AND_COMMENTS = re.compile(
    rb'"""(?:[^"\\]|\\.|"(?!""))*"""|'
    rb"'''(?:[^'\\]|\\.|'(?!''))*'''|"
    rb'"(?:[^"\\\n]|\\.)*"|'
    rb"'(?:[^'\\\n]|\\.)*'|"
    rb"#[^\n]*|\\\n",
    re.DOTALL,
)
_FOR_TYPES_ALONE = re.compile(
    rb"^([ \t]*)(?:el)?if TYPE_CHECKING:[^\n]*"
    rb"(?:\n(?:\1[ \t]+[^\n]*|[ \t]*$))*",
    re.MULTILINE,
)
_IMPORT = re.compile(
    rb"(?:^|[:;])[ \t]*"
    rb"(?:from[ \t]*(?P<home>[.\w \t]+?)[ \t]*\bimport\b[ \t]*"
    rb"(?:\((?P<block>[^)]*)\)|(?P<line>[^\n;]*))|"
    rb"import[ \t]+(?P<modules>[^\n;]*))",
    re.MULTILINE,
)


@functools.cache
def _find_imports(text: bytes, package: str) -> tuple[tuple[str, str], ...]:
    """Returns the imports that run in the source of a module of a package.

    Each is a module, and the name that is imported from it ("" for the module
    itself).
    """
    text = _TEXTS_AND_COMMENTS.sub(b" ", text.replace(b"\r", b"\n"))
    text = _FOR_TYPES_ALONE.sub(b"", text)
    names: list[tuple[str, str]] = []
    for found in _IMPORT.finditer(text):
        listed = found["block"] or found["line"] or found["modules"] or b""
        parts = [
            one.split()[0].decode() for one in listed.split(b",") if one.split()
        ]
        if found["home"] is None:
            names += [(name, "") for name in parts]
            continue
        home = b"".join(found["home"].split()).decode()
        with contextlib.suppress(ImportError):  # Running the file reports it.
            home = importlib.util.resolve_name(home, package)
        names += [(home, name) for name in parts]
    return tuple(names)


def _data_files(module: Path) -> Iterator[Path]:
    """Yields the data files that a module names, in its folder or below."""
    text = module.read_bytes()
    for path in sorted(module.parent.iterdir()):
        if path.suffix == ".py" or path.name.encode() not in text:
            continue
        if path.is_file():
            yield path
        elif not (path / "__init__.py").is_file():
            yield from (p for p in sorted(path.rglob("*")) if p.is_file())
