"""The decks of bridges in an imported road network, and their ends."""

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry import Structure
from cns_drake.imports.imported_objects import make_object
from cns_drake.imports.opendrive.lanes import LaneBand, lane_class

# The underside of a bridge is this far below its upper side [m].
_DECK_DEPTH = np.array([0.0, 0.0, 0.8])
# Triangles are dropped if twice their area is not greater than this [m^2].
_LEAST_TWICE_AREA = 1e-6
# How far the end of a bridge extends to both sides: wider than a kerb [m].
_END_REACH = 0.2


def bridge_decks(bands: Sequence[LaneBand]) -> Iterator[Structure]:
    """Yields the structures of bridges: their upper sides and undersides.

    `bands` contains the lanes on bridges.
    """
    of_road: dict[tuple[str, str], list[np.ndarray]] = defaultdict(list)
    for band in bands:
        # The sides of parts without a lane are closed as well.
        semantic_class = lane_class(band.kind) or "other-ground"
        left, right = band.inner, band.outer
        if band.lane.number > 0:
            left, right = right, left
        upper = _triangles_between(right, left)
        of_road[band.road.name, semantic_class].append(upper)
        low_left, low_right = left - _DECK_DEPTH, right - _DECK_DEPTH
        of_road[band.road.name, "other-structure"] += [
            _triangles_between(low_left, low_right),
            _triangles_between(low_right, right),
            _triangles_between(left, low_left),
        ]
    for (road, semantic_class), pieces in of_road.items():
        triangles = np.concatenate(pieces)
        edges = np.cross(
            triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
        )
        triangles = triangles[np.linalg.norm(edges, axis=1) > _LEAST_TWICE_AREA]
        if len(triangles):
            yield make_object(
                f"bridge_{road}_{semantic_class}",
                semantic_class,
                "Bridge",
                {"deck": triangles},
                {},
            ).structure


def bridge_ends(bands: Sequence[LaneBand]) -> BaseGeometry:
    """Returns narrow strips across the lanes at both ends of bridges, in W [m].

    `bands` contains the lanes on bridges.
    """
    lines = [
        LineString([band.inner[k, :2], band.outer[k, :2]])
        for band in bands
        for k in (0, -1)
    ]
    return shapely.union_all(lines).buffer(_END_REACH, cap_style="flat")


def _triangles_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Returns triangles between two lines (N, 3).

    The triangles look upwards if line `b` is to the left of line `a`.
    """
    return np.concatenate(
        [
            np.stack([a[:-1], a[1:], b[1:]], axis=1),
            np.stack([a[:-1], b[1:], b[:-1]], axis=1),
        ]
    )
