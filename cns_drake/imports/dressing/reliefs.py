"""Openings cut into panels, and boxes on them, as quads."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import Polygon, box

from cns_drake.city.geometry.triangulation import triangulate
from cns_drake.imports.dressing.wall_panels import Panel

# Distance of openings from the edge of a panel that is no rectangle, and width
# of a frame [m].
_BESIDE = 0.1
_FRAME = 0.09
# Distance in front of a panel of parts that are not cut into it [m].
_ON_WALL = 0.02
_EXACT = 1e-3
_LEAST_AREA = 1e-4
# The faces of a box on a panel: the limits (left, right, bottom, top, out and
# the panel's plane) of x, z and out (3, F, 4) of their corners.
_FACES = (
    ("lbo", "rbo", "rto", "lto"),
    ("lbp", "lbo", "lto", "ltp"),
    ("rbo", "rbp", "rtp", "rto"),
    ("lbp", "rbp", "rbo", "lbo"),
    ("lto", "rto", "rtp", "ltp"),
)
_BOX = np.moveaxis(
    np.array([[list(map("lrbtop".index, c)) for c in f] for f in _FACES]), 2, 0
)


class Openings(NamedTuple):
    """Rectangles of N openings in a panel.

    Attributes:
        row: (N,) number of its row; rows do not overlap one another.
        x0, x1, z0, z1: (N,) limits in the panel's coordinates [m].
        depth: (N,) [m].
        is_door: (N,) whether it is closed by a door, and not by glass.
    """

    row: np.ndarray
    x0: np.ndarray
    x1: np.ndarray
    z0: np.ndarray
    z1: np.ndarray
    depth: np.ndarray
    is_door: np.ndarray

    def chosen(self, which: np.ndarray) -> Openings:
        """Returns the openings of a mask or an index array (N,)."""
        return Openings(*(values[which] for values in self))

    def joined(self, others: Openings) -> Openings:
        """Returns these openings and others."""
        return Openings(*map(np.concatenate, zip(self, others, strict=True)))


class OpenedWall(NamedTuple):
    """A panel with openings.

    Attributes:
        quads: (K, 4, 3) fronts and reveals of the wall [m].
        triangles: (M, 3, 3) the other faces of the wall [m].
        backs: (N, 4, 3) panes and doors [m].
        openings: (N,) the openings that were cut.
    """

    quads: np.ndarray
    triangles: np.ndarray
    backs: np.ndarray
    openings: Openings


def fronts(
    panel: Panel,
    x0: np.ndarray,
    x1: np.ndarray,
    z0: np.ndarray,
    z1: np.ndarray,
    out: np.ndarray | float = 0.0,
) -> np.ndarray:
    """Returns rectangles (N, 4, 3) parallel to a panel [m].

    Args:
        panel: the wall.
        x0, x1, z0, z1: (N,) limits in its coordinates [m].
        out: (N,) distance from it outwards [m].
    """
    return _quads(panel, _BOX[:, :1], x0, x1, z0, z1, out)


def sides(
    panel: Panel,
    x0: np.ndarray,
    x1: np.ndarray,
    z0: np.ndarray,
    z1: np.ndarray,
    out: np.ndarray,
) -> np.ndarray:
    """Returns the faces (4 N, 4, 3) between rectangles and a panel [m].

    They are seen from within a recess (out < 0) or from beside a box.
    """
    return _quads(panel, _BOX[:, 1:], x0, x1, z0, z1, out)


def boxes_on(
    panel: Panel,
    x0: np.ndarray | float,
    x1: np.ndarray | float,
    z0: np.ndarray | float,
    z1: np.ndarray | float,
    reach: np.ndarray | float,
) -> np.ndarray:
    """Returns boxes without backs on a panel, (5 N, 4, 3) [m]."""
    return _quads(panel, _BOX, x0, x1, z0, z1, reach)


def _quads(
    panel: Panel, faces: np.ndarray, *limits: np.ndarray | float
) -> np.ndarray:
    """Returns the faces (F N, 4, 3) of N boxes, face by face [m].

    Args:
        panel: the wall.
        faces: (3, F, 4) index of the limit at each corner.
        limits: x0, x1, z0, z1 and the distance outwards, (N,) or one [m].
    """
    values = np.stack(
        [some.reshape(-1) for some in np.broadcast_arrays(*limits, 0.0)]
    ).astype(float)
    x, z, out = values[faces].transpose(0, 1, 3, 2).reshape(3, -1, 4)
    return panel.place(x, z, out)


def open_wall(
    panel: Panel, openings: Openings, has_recesses: bool = True
) -> OpenedWall | None:
    """Returns a panel with windows and doors; None where none fits.

    Args:
        panel: the wall.
        openings: within its bounding rectangle; rows that leave the outline
            of a panel which is no rectangle are left out, from the top down.
        has_recesses: whether they are cut into the panel; if not, panes and
            doors lie on it, which takes far fewer triangles.
    """
    area = (0.0, panel.length, 0.0, panel.height)
    rest = np.zeros((0, 3, 3))
    if panel.outline is not None:
        fitting = _fitting(panel, openings)
        if fitting is None:
            return None
        openings, area = fitting
        rest = _around(panel, area)
    if not len(openings.row):
        return None
    openings = openings.chosen(np.lexsort([openings.x0, openings.row]))
    _, x0, x1, z0, z1, depth, _ = openings
    if not has_recesses:
        backs = fronts(panel, x0, x1, z0, z1, _ON_WALL)
        empty = np.zeros((0, 4, 3))
        return OpenedWall(empty, panel.triangles, backs, openings)
    quads = fronts(panel, *_wall_between(openings, area))
    if depth.any():
        reveals = sides(panel, x0, x1, z0, z1, -depth)
        quads = np.concatenate([quads, reveals])
    return OpenedWall(
        quads, rest, fronts(panel, x0, x1, z0, z1, -depth), openings
    )


def framed(panel: Panel, openings: Openings) -> tuple[np.ndarray, np.ndarray]:
    """Returns the frames (4 N, 4, 3) and panes (N, 4, 3) of windows [m].

    Args:
        panel: the wall.
        openings: wider and higher than two frames.
    """
    _, x0, x1, z0, z1, depth, _ = openings
    a, b, c, d = x0 + _FRAME, x1 - _FRAME, z0 + _FRAME, z1 - _FRAME
    frames = [
        fronts(panel, x0, a, z0, z1, -depth),
        fronts(panel, b, x1, z0, z1, -depth),
        fronts(panel, a, b, z0, c, -depth),
        fronts(panel, a, b, d, z1, -depth),
    ]
    return np.concatenate(frames), fronts(panel, a, b, c, d, -depth)


def _wall_between(
    openings: Openings, area: tuple[float, float, float, float]
) -> np.ndarray:
    """Returns limits (4, K) of the rectangles between openings.

    Args:
        openings: sorted by row, then from left to right.
        area: x0, x1, z0, z1 that is filled [m].
    """
    left, right, bottom, top = area
    row, x0, x1, z0, z1 = openings[:5]
    rows, first, index = np.unique(row, return_index=True, return_inverse=True)
    low = np.minimum.reduceat(z0, first)
    high = np.maximum.reduceat(z1, first)
    last = np.append(first[1:], len(row)) - 1
    is_first = np.zeros(len(row), dtype=bool)
    is_first[first] = True
    before = np.where(is_first, left, np.roll(x1, 1))
    strips = np.array(
        [
            np.full(len(rows) + 1, left),
            np.full(len(rows) + 1, right),
            np.append(bottom, high),
            np.append(low, top),
        ]
    )
    found = np.concatenate(
        [
            strips,
            [before, x0, low[index], high[index]],
            [x1[last], np.full(len(rows), right), low, high],
            [x0, x1, low[index], z0],
            [x0, x1, z1, high[index]],
        ],
        axis=1,
    )
    is_there = (found[1] - found[0] > _EXACT) & (found[3] - found[2] > _EXACT)
    return np.asarray(found[:, is_there])


def _fitting(
    panel: Panel, openings: Openings
) -> tuple[Openings, tuple[float, float, float, float]] | None:
    """Returns openings in a panel, with their bounding rectangles."""
    outline = shapely.buffer(panel.whole(), _EXACT, join_style="mitre")
    while len(openings.row):
        found = (
            max(0.0, float(openings.x0.min()) - _BESIDE),
            min(panel.length, float(openings.x1.max()) + _BESIDE),
            max(0.0, float(openings.z0.min()) - _BESIDE),
            min(panel.height, float(openings.z1.max()) + _BESIDE),
        )
        x0, x1, z0, z1 = (round(value, 3) for value in found)
        area = x0, x1, z0, z1
        if outline.contains(_rectangle(area)):
            return openings, area
        openings = openings.chosen(openings.row < openings.row.max())
    return None


def _rectangle(area: tuple[float, float, float, float]) -> Polygon:
    x0, x1, z0, z1 = area
    return box(x0, z0, x1, z1)


def _around(
    panel: Panel, area: tuple[float, float, float, float]
) -> np.ndarray:
    """Returns a panel without an area, as triangles (M, 3, 3) [m]."""
    rest = shapely.difference(panel.whole(), _rectangle(area), grid_size=_EXACT)
    flat = [np.zeros((0, 3, 2))]
    for part in shapely.get_parts(rest):
        if isinstance(part, Polygon) and part.area > _LEAST_AREA:
            flat.append(triangulate(part))
    xz = np.concatenate(flat)
    return panel.place(xz[..., 0], xz[..., 1])
