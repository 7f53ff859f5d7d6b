"""Reads road networks in OpenDRIVE 1.4 to 1.7, and builds towns on them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from evaluation.base import uninterrupted
from worlds.imports.map_source import MapSource
from worlds.imports.options import ImportOptions


def _write_town(
    source: Path,
    options: ImportOptions,
    own: Sequence[Any] | None,
    folder: Path,
) -> Any:
    with uninterrupted():  # This imports the whole city generator.
        from worlds.imports.opendrive.town import build_town, write_town

    return write_town(folder, source, build_town(source, options, own))


SOURCE = MapSource(
    "OpenDRIVE",
    (".xodr",),
    write_town=_write_town,
    lacks={
        "--years": "years of construction",
        "--lod": "levels of detail",
    },
)
