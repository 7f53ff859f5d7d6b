"""Imports buildings, streets and land from OpenStreetMap files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from worlds.imports.map_source import MapSource
from worlds.imports.options import ImportOptions

if TYPE_CHECKING:
    from worlds.imports.foreign_city import ForeignCity


def _read(source: Path, options: ImportOptions) -> ForeignCity:
    from worlds.imports.openstreetmap.city import import_openstreetmap

    return import_openstreetmap(source, options.year_attribute, options.dressed)


SOURCE = MapSource(
    "OpenStreetMap",
    (".osm", ".pbf"),
    read=_read,
    lacks={"--lod": "levels of detail"},
)
