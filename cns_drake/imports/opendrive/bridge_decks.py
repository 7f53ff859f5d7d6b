"""Decks of bridges: lanes above other lanes, visible from below."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry.structures import Structure
from cns_drake.imports.foreign_city import make_imported
from cns_drake.imports.opendrive.lane_bands import LaneBand
from cns_drake.imports.opendrive.lane_kinds import lane_class

_DEPTH = np.array([0.0, 0.0, 0.8])  # [m]
_LEAST_AREA = 1e-6
# Wider than a kerb [m].
_END = 0.2


def bridge_decks(bands: Sequence[LaneBand]) -> Iterator[Structure]:
    """Yields the upper sides of bridges by class, and their undersides."""
    of_road: dict[tuple[str, str], list[np.ndarray]] = defaultdict(list)
    for band in bands:
        # Parts without a lane are closed as well.
        kind = lane_class(band.kind) or "other-ground"
        left, right = band.inner, band.outer
        if band.lane.number > 0:
            left, right = right, left
        of_road[band.road.name, kind].append(_strip(right, left))
        low_left, low_right = left - _DEPTH, right - _DEPTH
        of_road[band.road.name, "other-structure"] += [
            _strip(low_left, low_right),
            _strip(low_right, right),
            _strip(left, low_left),
        ]
    for (road, kind), pieces in of_road.items():
        triangles = np.concatenate(pieces)
        edges = np.cross(
            triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
        )
        triangles = triangles[np.linalg.norm(edges, axis=1) > _LEAST_AREA]
        if len(triangles):
            yield make_imported(
                f"bridge_{road}_{kind}", kind, "Bridge", {"deck": triangles}, {}
            ).structure


def bridge_ends(bands: Sequence[LaneBand]) -> BaseGeometry:
    """Returns the area about the ends of bridges [m]."""
    lines = [
        LineString([band.inner[k, :2], band.outer[k, :2]])
        for band in bands
        for k in (0, -1)
    ]
    return shapely.union_all(lines).buffer(_END, cap_style="flat")


def _strip(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Returns triangles between lines (N, 3), upward if the second is left."""
    return np.concatenate(
        [
            np.stack([a[:-1], a[1:], b[1:]], axis=1),
            np.stack([a[:-1], b[1:], b[:-1]], axis=1),
        ]
    )
