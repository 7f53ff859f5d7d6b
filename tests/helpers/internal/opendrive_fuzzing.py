"""A small file of OpenDRIVE to damage, and its readers."""

from pathlib import Path

from evaluation.base import InputError
from helpers.small_opendrive import (
    TWO_LANES,
    cubic,
    geometry,
    road,
    section,
    write_roads,
)
from worlds.imports.drives.search import find_drives
from worlds.imports.faults import ImportFaults
from worlds.imports.opendrive.band_graph import BandGraph
from worlds.imports.opendrive.bridges import split_levels
from worlds.imports.opendrive.imported_streets import ImportedStreets
from worlds.imports.opendrive.lanes import lane_bands
from worlds.imports.opendrive.road_reader import read_roads
from worlds.imports.opendrive.things import thing_structures


def write_opendrive(folder: Path) -> None:
    shapes = (
        ("<line/>", 20.0),
        ('<spiral curvStart="0" curvEnd="0.04"/>', 25.0),
        ('<paramPoly3 aU="0" bU="30" cU="-2" dU="1" aV="0" bV="0" cV="8"'
         ' dV="-3"/>', 30.0),
    )  # fmt: skip
    pieces = [
        geometry(20.0 * k, 25.0 * k, 0.0, 0.1, length, shape)
        for k, (shape, length) in enumerate(shapes)
    ]
    signs = (
        '<signals><signal s="5" t="-6" type="206"/></signals><objects><object'
        ' type="pole" s="9" t="7" radius="0.1" height="5"><repeat s="9"'
        ' length="20" distance="4"/></object></objects>'
    )
    write_roads(
        folder / "town.xodr",
        road(
            "1", 70.0, pieces,
            [section(0.0, *TWO_LANES), section(30.0, *TWO_LANES)],
            elevation=cubic("elevation", 0, 1.0, 0.02, key="s"), more=signs,
        ),
    )  # fmt: skip


def read_opendrive(folder: Path) -> None:
    faults = ImportFaults()
    roads = read_roads(folder / "town.xodr", faults).roads
    try:
        bands = [band for one in roads for band in lane_bands(one)]
    except ValueError as error:
        raise InputError(str(error)) from error
    streets = ImportedStreets(split_levels(bands, faults)[0])
    find_drives(BandGraph(bands))
    for one in roads:
        list(thing_structures(one, streets.areas.lane_area, faults))
