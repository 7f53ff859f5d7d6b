"""The ground near a drive, with its carriageway and kerbs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from cns_drake.city.geometry.polygons import polygons_of
from cns_drake.scene.surfaces import TriangleSurface
from cns_drake.transient.standing import GROUND_CLASSES, Standing, StandingPart

# Steeper surfaces are not ground: sine of their slope against the vertical.
_LEAST_UP = 0.3
# Slits between triangles are closed up to twice this width [m].
_SEAM = 0.05
# Smaller islands and holes have no kerb of their own [m^2].
_LEAST_AREA = 4.0


class Kerb(NamedTuple):
    """A stretch of the edge of the carriageway.

    Attributes:
        points: (N, 2) along it [m].
        outwards: (N, 2) unit vectors, away from the carriageway.
    """

    points: np.ndarray
    outwards: np.ndarray


class GroundSurface:
    """The ground below things near a drive.

    Attributes:
        near: its area [m].
    """

    def __init__(self, things: Mapping[str, Standing], near: BaseGeometry):
        """Collects it.

        Args:
            things: all structures.
            near: the area to collect [m].
        """
        shapely.prepare(near)
        self.near = near
        corners, is_road = [np.zeros((0, 3, 3))], [np.zeros(0, bool)]
        for thing in things.values():
            if thing.semantic_class in GROUND_CLASSES:
                for part in thing.parts:
                    found = self._upward(part)
                    corners.append(found)
                    road = thing.semantic_class == "road"
                    is_road.append(np.full(len(found), road))
        self._corners = np.concatenate(corners)
        self._is_road = np.concatenate(is_road)
        self._tree = shapely.STRtree(from_above(self._corners))

    def _upward(self, part: StandingPart) -> np.ndarray:
        corners = faced_up(triangle_corners(part))
        middles = corners[:, :, :2].mean(axis=1)
        return corners[
            (upwardness(corners) > _LEAST_UP)
            & shapely.contains_xy(self.near, middles)
        ]

    @cached_property
    def carriageway(self) -> BaseGeometry:
        """The area of class `road`, seen from above [m]."""
        roads = from_above(self._corners[self._is_road])
        joined = shapely.unary_union(roads, grid_size=0.001)
        return joined.buffer(_SEAM).buffer(-_SEAM)

    def heights(self, xy: np.ndarray, *, of_road: bool) -> np.ndarray:
        """Returns the height of the ground at places; NaN without ground.

        Args:
            xy: (N, 2) places [m].
            of_road: whether of carriageways, or of all other ground.
        """
        place, index = self._tree.query(shapely.points(xy), "intersects")
        right = self._is_road[index] == of_road
        place, index = place[right], index[right]
        a, b, c = np.moveaxis(self._corners[index], 1, 0)
        normals = np.cross(b - a, c - a)
        offset = xy[place] - a[:, :2]
        z = a[:, 2] - (normals[:, :2] * offset).sum(axis=1) / normals[:, 2]
        found = np.full(len(xy), -np.inf)
        np.maximum.at(found, place, z)
        return np.where(np.isfinite(found), found, np.nan)

    def kerbs(self, spacing: float) -> Iterator[Kerb]:
        """Yields the edges of the carriageway within the area.

        Args:
            spacing: of their points, at most [m].
        """
        inner = self.near.buffer(-1.0)  # The edge of `near` is no kerb.
        shapely.prepare(inner)
        for polygon in polygons_of(self.carriageway):
            turned = orient(polygon)
            for ring in (turned.exterior, *turned.interiors):
                if shapely.Polygon(ring).area < _LEAST_AREA:
                    continue
                xy = shapely.get_coordinates(ring.segmentize(spacing))[:-1]
                yield from _runs(xy, shapely.contains_xy(inner, xy))


def _runs(xy: np.ndarray, inside: np.ndarray) -> Iterator[Kerb]:
    """Yields rings of an area, with the area on their left."""
    along = np.roll(xy, -1, axis=0) - np.roll(xy, 1, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    outwards = np.column_stack([along[:, 1], -along[:, 0]])
    if inside.all():
        order = np.append(np.arange(len(xy)), 0)
        yield Kerb(xy[order], outwards[order])
        return
    first = int(np.argmin(inside))
    order = np.roll(np.arange(len(xy)), -first)
    edges = np.flatnonzero(np.diff(inside[order].astype(int)))
    for begin, end in zip(edges[::2] + 1, edges[1::2] + 1, strict=False):
        if end - begin >= 2:
            run = order[begin:end]
            yield Kerb(xy[run], outwards[run])
    if len(edges) % 2 and len(order) - edges[-1] > 2:
        run = order[edges[-1] + 1 :]
        yield Kerb(xy[run], outwards[run])


def triangle_corners(part: StandingPart) -> np.ndarray:
    """Returns the (M, 3, 3) corners of a part's triangles in the world [m]."""
    surface = part.geometry.surface
    if not isinstance(surface, TriangleSurface):
        return np.zeros((0, 3, 3))
    return part.p_WPs[surface.triangles]


def faced_up(corners: np.ndarray) -> np.ndarray:
    """Returns triangles of ground, with either winding in the file."""
    down = upwardness(corners) < 0.0
    return np.where(down[:, None, None], corners[:, ::-1], corners)


def from_above(corners: np.ndarray) -> np.ndarray:
    """Returns the (M,) polygons of triangles (M, 3, 3) seen from above."""
    return np.asarray(shapely.polygons(corners[:, :, :2]), object)


def upwardness(corners: np.ndarray) -> np.ndarray:
    """Returns the z of the normals of triangles (M, 3, 3); 0 of slivers."""
    a, b, c = np.moveaxis(corners, 1, 0)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    return normals[:, 2] / np.where(lengths > 0.0, lengths, np.inf)
