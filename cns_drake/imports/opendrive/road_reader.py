"""Reads roads from an OpenDRIVE file.

The import joins lanes whose ends meet, and does not use the links between
roads, lanes and junctions. The import only reports, as faults, links to things
that are not in the file.
"""

from collections.abc import Iterable, Iterator
import contextlib
from dataclasses import replace
import math
from pathlib import Path
import re

import numpy as np

from cns_drake.base.errors import InputError, value_errors
from cns_drake.base.xml_elements import Element, read_elements
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.opendrive import road_model
from cns_drake.imports.opendrive.course_reader import (
    LONGEST_ROAD,
    WIDEST_JOINT,
    read_course,
)
from cns_drake.imports.opendrive.dangling_links import count_dangling_links
from cns_drake.imports.opendrive.lane_reader import (
    read_cubics,
    read_sections,
    step_function,
)
from cns_drake.imports.opendrive.thing_reader import read_things
from cns_drake.imports.opendrive.unread import count_unread

_UNITS = {"m/s": 1.0, "km/h": 1 / 3.6, "mph": 0.44704}
# Greatest speed limit [m/s].
_FASTEST = 100.0
# Greatest extent of a network along x or y; whole countries are refused [m].
_LARGEST = 20_000.0
# Greatest length of all roads of a network together [m].
_MOST_TOGETHER = 2_000_000.0
# If any road is farther from the origin than this, all are moved to it [m].
_FAR_AWAY = 10_000.0
# Lengths that differ by less than this are equal [m].
_ROUNDING = 0.01
# Greatest roll of a road; banked test tracks have up to 49 deg [rad].
_MOST_ROLL = math.radians(50.0)
# Names are cut to this length where they become part of other names.
_LONGEST_NAME = 60


def read_roads(path: Path, faults: ImportFaults) -> road_model.RoadMap:
    """Returns all roads of a file.

    Raises:
        InputError: the file cannot be read, or describes an impossible road.
            The message names the file, the road, the line and the fault.
    """
    top = read_elements(path, "OpenDRIVE")
    roads: list[road_model.ImportedRoad] = []
    names: set[str] = set()
    together = 0.0
    for kind in ("road", "junction"):
        with value_errors(path):
            _check_ids(top.all(kind))
    for element in top.all("road"):
        name = _unique_name(element.attrib.get("id", ""), names)
        names.add(name)
        with value_errors(f"{path}: road {name}"):
            road = _read_road(element, name, faults)
        if road is not None:
            roads.append(road)
            together += road.length
    if not roads:
        raise InputError(f"{path}: the file has no roads")
    count_dangling_links(top, faults)
    count_unread(top, faults, "the file")
    if together > _MOST_TOGETHER:
        raise InputError(
            f"{path}: {together / 1000:.0f} km of roads; at most "
            f"{_MOST_TOGETHER / 1000:.0f} km can be read"
        )
    ends = np.array([(p.x, p.y) for road in roads for p in road.pieces])
    low, high = ends.min(axis=0), ends.max(axis=0)
    size = float((high - low).max())
    if size > _LARGEST:
        raise InputError(
            f"{path}: {size / 1000:.0f} km across; cut out a piece of at most"
            f" {_LARGEST / 1000:.0f} km"
        )
    x = y = 0.0
    if np.abs(ends).max() > _FAR_AWAY:
        x, y = np.round((low + high) / 2.0).tolist()
    reference = top.first("header", "geoReference")
    return road_model.RoadMap(
        tuple(_moved(road, x, y) for road in roads),
        " ".join((reference.text or "").split())
        if reference is not None
        else "",
        (x, y, 0.0),
    )


def _check_ids(elements: Iterable[Element]) -> None:
    """Checks that all elements of a kind have different ids.

    Raises:
        ValueError: two elements have the same id; the message names the id and
            the lines.
    """
    lines: dict[str, int] = {}
    for one in elements:
        own = one.value("id", "")
        if own in lines:
            raise ValueError(
                f"{one.tag} {_plain_name(own)}: line {one.line}: duplicate id,"
                f" that of line {lines[own]}"
            )
        lines[own] = one.line


def _unique_name(own: str, taken: set[str]) -> str:
    """Returns a new, unique name of letters, digits, dots and dashes."""
    stem = _plain_name(own)
    name = stem
    number = 1
    while name in taken:
        number += 1
        name = f"{stem}-{number}"
    return name


def _plain_name(own: str) -> str:
    """Returns an id reduced to letters, digits, dots and dashes."""
    return re.sub(r"[^0-9A-Za-z.-]+", "-", own)[:_LONGEST_NAME] or "unnamed"


def _moved(
    road: road_model.ImportedRoad, x: float, y: float
) -> road_model.ImportedRoad:
    pieces = [replace(p, x=p.x - x, y=p.y - y) for p in road.pieces]
    return replace(road, pieces=tuple(pieces))


def _read_road(
    element: Element, name: str, faults: ImportFaults
) -> road_model.ImportedRoad | None:
    pieces = read_course(element.all("planView", "geometry"), name, faults)
    if not pieces:
        faults.add("road without a course, left out", name)
        return None
    stated = element.number("length")
    length = pieces[-1].s + pieces[-1].length
    if abs(stated - length) > _ROUNDING:
        faults.add("road whose length differs from its course's, cut", name)
        length = min(stated, length)
    if length > LONGEST_ROAD:
        raise ValueError(f"{length:g} m are more than {LONGEST_ROAD:g} m")
    sections = read_sections(element, length, name, faults)
    if not sections:
        faults.add("road without lanes, left out", name)
        return None
    if max(pieces[0].s, sections[0].start) > WIDEST_JOINT:
        faults.add("road whose course or lanes begin after its start", name)
    if element.first("lateralProfile", "shape") is not None:
        faults.add("lateral shape of a road, not read", name)
    junction = element.value("junction", "-1")
    banking = read_cubics(element.all("lateralProfile", "superelevation"), "s")
    along = np.linspace(0.0, length, math.ceil(length) + 1)
    if banking and np.abs(banking.at(along, along)).max() > _MOST_ROLL:
        faults.add("superelevation beyond 50 deg, taken as level", name)
        banking = road_model.Cubics()
    offsets = element.all("lanes", "laneOffset")
    return road_model.ImportedRoad(
        name=name,
        junction=None if junction == "-1" else junction,
        length=length,
        pieces=tuple(pieces),
        elevation=read_cubics(
            element.all("elevationProfile", "elevation"), "s"
        ),
        superelevation=banking,
        lane_offset=read_cubics(offsets, "s"),
        sections=tuple(sections),
        keeps_left=element.value("rule", "RHT").upper() == "LHT",
        limits=step_function(_speed_limits(element, name, faults)),
        things=tuple(read_things(element, name, faults)),
        spans=tuple(
            one.tag
            for tag in ("bridge", "tunnel")
            for one in element.all("objects", tag)
        ),
    )


def _speed_limits(
    road: Element, name: str, faults: ImportFaults
) -> Iterator[tuple[float, float]]:
    """Yields the start [m] and the value [m/s] of each speed limit."""
    for one in road.all("type"):
        limit = 0.0
        speed = one.first("speed")
        if speed is not None:
            with contextlib.suppress(ValueError):
                limit = float(speed.value("max", ""))
            limit *= _UNITS.get(speed.value("unit", "m/s"), 0.0)
            if not 0.0 < limit <= _FASTEST:
                kind = "unlimited or unreadable speed, taken as 50 km/h"
                faults.add(kind, name)
                limit = 0.0
        yield one.number("s", 0.0), limit
