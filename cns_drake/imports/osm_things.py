"""Small things of OpenStreetMap, as objects of the city generator."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
import re

import numpy as np
import shapely
from shapely.geometry import LineString

from cns_drake.imports.foreign_city import Thing
from cns_drake.imports.osm_places import Local
from cns_drake.imports.osm_reading import OsmWay, Tags, has_tag

# Key and value -> object; an empty value stands for any.
_OBJECTS = (
    ("highway", "street_lamp", "lamp_post"),
    ("highway", "bus_stop", "bus_shelter"),
    ("highway", "traffic_signals", "traffic_light_post"),
    ("highway", "stop", "sign_stop"),
    ("highway", "give_way", "sign_triangular"),
    ("highway", "traffic_sign", "sign_round"),
    ("amenity", "bench", "bench"),
    ("amenity", "waste_basket", "litter_bin"),
    ("amenity", "waste_disposal", "recycling_bins"),
    ("amenity", "recycling", "recycling_bins"),
    ("amenity", "post_box", "post_box"),
    ("amenity", "bicycle_parking", "bicycle_rack"),
    ("amenity", "telephone", "phone_box"),
    ("emergency", "fire_hydrant", "hydrant"),
    ("barrier", "bollard", "bollard"),
    ("man_made", "street_cabinet", "cabinet"),
    ("advertising", "column", "advertising_pillar"),
    ("vending", "parking_tickets", "ticket_machine"),
    ("traffic_sign", "", "sign_round"),
)
_TREE_DISTANCE = 8.0  # [m]


def object_of(tags: Tags) -> str | None:
    """Returns the object of a node; None without one."""
    found = [
        name
        for key, value, name in _OBJECTS
        if has_tag(tags, key) and value in ("", tags[key])
    ]
    if not found:
        return None
    name = found[0]
    if tags.get("fire_hydrant:type", "pillar") != "pillar":
        return None
    if tags.get("lamp_mount", tags.get("support", "pole")) not in (
        "pole",
        "straight_mast",
        "bent_mast",
        "mast",
    ):
        return None
    if name == "bus_shelter" and tags.get("shelter") != "yes":
        return "sign_rectangular"
    return name


def make_things(
    nodes: Iterable[tuple[str, Tags, tuple[float, float]]],
    ways: Iterable[OsmWay],
    kinds: Mapping[str, str],
    local: Local,
) -> Iterator[Thing]:
    """Yields things at their nodes, and the trees of rows.

    Args:
        nodes: id, tags and place of each [deg].
        ways: of the file.
        kinds: id -> kind of a thing.
        local: brings places to metres.
    """
    for name, tags, place in nodes:
        kind = object_of(tags)
        if kind is not None:
            x, y = local(np.array([place]))[0].tolist()
            direction = _direction(tags)
            yield Thing(name, kinds[name], kind, (x, y), direction)
    for name, tags, line, _ in ways:
        if tags.get("natural") == "tree_row":
            needles = tags.get("leaf_type") == "needleleaved"
            course = LineString(local(line))
            count = max(1, round(course.length / _TREE_DISTANCE))
            steps = (np.arange(count) + 0.5) / count
            points = shapely.line_interpolate_point(
                course, steps, normalized=True
            )
            kind = "spruce" if needles else "lime_tree"
            for x, y in shapely.get_coordinates(points).tolist():
                yield Thing(name, kinds[name], kind, (x, y), None)


def _direction(tags: Tags) -> float | None:
    """Returns the heading of a thing, if its tags have one [rad]."""
    text = tags.get("direction", "")
    if not re.fullmatch(r"\d{1,3}(\.\d+)?", text):
        return None
    return float(np.radians(90.0 - float(text)))
