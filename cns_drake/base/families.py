"""A family of modules: a member is a file, which is found by its name."""

from collections.abc import Mapping
import functools
import importlib
from pathlib import Path
import re
from types import MappingProxyType


@functools.cache
def family_members(package: str, mark: str) -> Mapping[str, str]:
    """Returns the members of a family that lie in a package.

    A member is a module, or a package with an `__init__.py`, whose source has a
    line that begins with a mark, such as `LAYOUT = `. Nothing is imported.
    Fingerprints of results follow this function: a module that calls it depends
    on all modules of its package.

    Args:
        package: full name of the package.
        mark: the beginning of the line.

    Returns:
        Name of the file without its suffix -> full name of the module, sorted.
    """
    folder = Path(str(importlib.import_module(package).__file__)).parent
    line = re.compile(rb"^" + re.escape(mark.encode()), re.MULTILINE)
    sources = [*folder.glob("*.py"), *folder.glob("*/__init__.py")]
    names = [
        path.parent.name if path.name == "__init__.py" else path.stem
        for path in sources
        if path != folder / "__init__.py" and line.search(path.read_bytes())
    ]
    return MappingProxyType({one: f"{package}.{one}" for one in sorted(names)})
