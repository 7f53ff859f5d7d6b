"""Imports cities from CityJSON and CityJSONSeq files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from worlds.imports.map_source import MapSource
from worlds.imports.options import ImportOptions

if TYPE_CHECKING:
    from worlds.imports.foreign_city import ForeignCity


def _read(source: Path, options: ImportOptions) -> ForeignCity:
    from worlds.imports.cityjson.city import import_cityjson

    return import_cityjson(source, options.lod, options.year_attribute)


SOURCE = MapSource("CityJSON", (".json", ".jsonl"), read=_read)
