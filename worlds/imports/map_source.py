"""What a member of the family of map sources says of itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any

from evaluation.base import InputError, import_modules
from worlds.imports.options import ImportOptions

if TYPE_CHECKING:
    from worlds.imports.foreign_city import ForeignCity


@dataclass(frozen=True)
class MapSource:
    """A format from which maps are imported.

    A package below `worlds.imports` has a map source as its constant
    `SOURCE`. Give `read` or `write_town`.

    Attributes:
        title: name of the format.
        suffixes: endings of the names of its files, such as `.osm`.
        read: function that reads a city from a file.
        write_town: function that builds a town along the roads in a file. Its
            arguments are the file, the options, the user's own drives (None to
            propose drives), and the folder to write; it returns the report and
            the sizes of the stages (see `import_city`).
        lacks: option -> what the format lacks for this option.
    """

    title: str
    suffixes: tuple[str, ...]
    read: Callable[[Path, ImportOptions], ForeignCity] | None = None
    write_town: Callable[[Path, ImportOptions, Any, Path], Any] | None = None
    lacks: Mapping[str, str] = field(default_factory=dict)

    @property
    def has_stages(self) -> bool:
        """Whether a map has two stages, whatever the options are."""
        return self.write_town is not None

    def check_options(self, source: Path, options: ImportOptions) -> None:
        """Raises an InputError if an option needs what the format lacks."""
        given = {
            "--years": bool(options.years),
            "--lod": options.lod is not None,
        }
        for option, lacking in self.lacks.items():
            if given[option]:
                raise InputError(
                    f"{option}: {source} ({self.title}) has no {lacking}; leave"
                    " the option out"
                )


@functools.cache
def map_sources() -> tuple[MapSource, ...]:
    """Returns the formats from which maps are imported."""
    modules = import_modules(str(__package__), only_packages=True)
    return tuple(
        one.SOURCE for one in modules.values() if hasattr(one, "SOURCE")
    )


def source_of(path: Path) -> MapSource:
    """Returns the format of a file, by the ending of its name.

    Raises:
        InputError: no format has this ending.
    """
    for source in map_sources():
        if path.suffix in source.suffixes:
            return source
    known = [
        f"{one.title} ({', '.join(one.suffixes)})" for one in map_sources()
    ]
    raise InputError(f"{path}: not {', '.join(known[:-1])} or {known[-1]}")
