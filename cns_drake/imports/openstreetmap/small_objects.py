"""Small objects and trees of OpenStreetMap."""

from __future__ import annotations

from collections.abc import Iterator
import re

import numpy as np
import shapely
from shapely.geometry import LineString

from cns_drake.imports.foreign_city import SmallObject
from cns_drake.imports.openstreetmap.features import OsmFeatures, Tags
from cns_drake.imports.openstreetmap.local_metres import LocalMetres
from cns_drake.imports.openstreetmap.tags import TABLES, has_tag, is_inside

# Names of directions, clockwise from north.
_COMPASS = (
    "N", "NNE", "NE", "ENE", "E", "ESE", "SE", "SSE",
    "S", "SSW", "SW", "WSW", "W", "WNW", "NW", "NNW",
)  # fmt: skip
# Values of the tags `lamp_mount` and `support` for an object that stands on a
# post of its own. With other values, such as `wall_mounted`, another structure
# carries the object.
_POSTS = ("pole", "straight_mast", "bent_mast", "mast")
_TREE_DISTANCE = 8.0  # [m]


def object_kind(tags: Tags) -> str | None:
    """Returns the kind of small object that a node's tags describe.

    The kind is a key of `cns_drake.city.placement.objects.OBJECTS`, or None for
    a node without such an object.
    """
    found = [
        name
        for key, value, name in TABLES["objects"]
        if has_tag(tags, key) and value in ("", tags[key])
    ]
    if not found:
        return None
    name: str = found[0]
    if tags.get("fire_hydrant:type", "pillar") != "pillar":
        return None
    if tags.get("lamp_mount", tags.get("support", "pole")) not in _POSTS:
        return None
    if name == "bus_shelter" and tags.get("shelter") != "yes":
        return "sign_rectangular"
    return name


def make_small_objects(
    features: OsmFeatures, local: LocalMetres
) -> Iterator[SmallObject]:
    """Yields small objects: objects at nodes, and the trees of tree rows.

    `local` converts places of the file to metres in W.
    """
    elements = features.kinds
    for name, tags, place in features.nodes:
        kind = object_kind(tags)
        if kind is not None and not is_inside(tags):
            x, y = local(np.array([place]))[0].tolist()
            direction = _direction(tags)
            yield SmallObject(name, elements[name], kind, (x, y), direction)
    for name, tags, line, _ in features.ways:
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
                yield SmallObject(name, elements[name], kind, (x, y), None)


def _direction(tags: Tags) -> float | None:
    """Returns the heading in a thing's tags [rad]; None if they have none."""
    text = tags.get("direction", "")
    if text.upper() in _COMPASS:
        text = str(22.5 * _COMPASS.index(text.upper()))
    if not re.fullmatch(r"\d{1,3}(\.\d+)?", text):
        return None
    return float(np.radians(90.0 - float(text)))
