"""The formats to which recordings are exported: a family, found by name."""

from pathlib import Path
import pkgutil

# A module with this ending has the layout of a format.
ENDING = "_layout"


def export_formats() -> tuple[str, ...]:
    """Returns the names of the formats to which a recording is exported."""
    modules = pkgutil.iter_modules([str(Path(__file__).parent)])
    return tuple(
        one.name.removesuffix(ENDING)
        for one in modules
        if one.name.endswith(ENDING)
    )
