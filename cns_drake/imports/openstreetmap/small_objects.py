"""Small objects and trees of OpenStreetMap."""

from __future__ import annotations

from collections.abc import Iterator
import math

import numpy as np
import shapely
from shapely.geometry import LineString

from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.foreign_city import SmallObject
from cns_drake.imports.openstreetmap.features import OsmFeatures, Tags
from cns_drake.imports.openstreetmap.tags import (
    TABLES,
    has_tag,
    heading_deg,
    is_inside,
    length,
    tag_value,
)
from cns_drake.scene import LocalMetres

# Values of the tags `lamp_mount` and `support` for an object that stands on a
# post of its own. With other values, such as `wall_mounted`, another structure
# carries the object.
_POSTS = ("pole", "straight_mast", "bent_mast", "mast")
_TALLEST_TREE = 150.0  # [m]
# Distance between the trees of a tree row [m].
_TREE_SPACING = 8.0


def object_kind(tags: Tags) -> str | None:
    """Returns the kind of small object that a node's tags describe.

    The kind is a key of `cns_drake.city.placement.objects.OBJECTS`, or None for
    a node without such an object.
    """
    kinds: list[str] = [
        kind
        for key, value, kind in TABLES["objects"]
        if has_tag(tags, key) and value in ("", tags[key])
    ]
    if not kinds:
        return None
    if tags.get("fire_hydrant:type", "pillar") != "pillar":
        return None
    if tags.get("lamp_mount", tags.get("support", "pole")) not in _POSTS:
        return None
    if kinds[0] == "bus_shelter" and tags.get("shelter") != "yes":
        return "sign_rectangular"
    return kinds[0]


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
            heading = _heading(tags)
            yield SmallObject(name, elements[name], kind, (x, y), heading)
    for name, tags, line, _ in features.ways:
        if tags.get("natural") == "tree_row":
            needles = tags.get("leaf_type") == "needleleaved"
            course = LineString(local(line))
            count = max(1, round(course.length / _TREE_SPACING))
            steps = (np.arange(count) + 0.5) / count
            points = shapely.line_interpolate_point(
                course, steps, normalized=True
            )
            kind = "spruce" if needles else "lime_tree"
            height = tree_height(name, tags, features.faults)
            for xy in map(tuple, shapely.get_coordinates(points).tolist()):
                yield SmallObject(name, elements[name], kind, xy, None, height)


def tree_height(name: str, tags: Tags, faults: ImportFaults) -> float | None:
    """Returns the height of a tree, or of a row's trees [m]; None if unknown.

    A height that cannot be is counted in `faults`.
    """
    where = (name, faults)
    return tag_value(tags, "height", length, _TALLEST_TREE, where) or None


def _heading(tags: Tags) -> float | None:
    """Returns the heading in an object's tags [rad]; None if there is none."""
    found = heading_deg(tags.get("direction"))
    return None if found is None else math.radians(found)
