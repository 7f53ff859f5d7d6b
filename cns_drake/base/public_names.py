"""The public names of a package, each imported when it is first used."""

from collections.abc import Callable
import importlib
from pathlib import Path
import re
from typing import Any

# A line of a stub. Parsing a stub would take longer than the imports.
_LINE = re.compile(r"^from (\S+) import \(?\s*(\w+) as \2", re.MULTILINE)


def attach(
    package: str, file: str
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Returns the functions `__getattr__` and `__dir__` and the list `__all__`.

    A package that assigns them in its `__init__.py` imports each of its public
    names when the name is first used. The stub `__init__.pyi` next to `file`
    lists the public names and the modules that define them.

    Args:
        package: the package's `__name__`.
        file: the package's `__file__`.
    """
    stub = Path(file).with_suffix(".pyi").read_text(encoding="utf-8")
    homes = {name: home for home, name in _LINE.findall(stub)}

    def get(name: str) -> Any:
        home = homes.get(name)
        if home == package:  # A module that is offered as a whole.
            return importlib.import_module(f"{package}.{name}")
        if home is not None:
            return getattr(importlib.import_module(home), name)
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return get, lambda: sorted(homes), list(homes)
