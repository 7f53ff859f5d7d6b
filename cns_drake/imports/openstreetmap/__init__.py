"""Imports buildings, streets and land from OpenStreetMap files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cns_drake.imports.map_source import MapSource
from cns_drake.imports.options import ImportOptions

if TYPE_CHECKING:
    from cns_drake.imports.foreign_city import ForeignCity


def _read(source: Path, options: ImportOptions) -> ForeignCity:
    from cns_drake.imports.openstreetmap.city import import_openstreetmap

    return import_openstreetmap(source, options.year_attribute, options.dressed)


SOURCE = MapSource(
    "OpenStreetMap",
    (".osm", ".pbf"),
    read=_read,
    lacks={"--lod": "levels of detail"},
)
