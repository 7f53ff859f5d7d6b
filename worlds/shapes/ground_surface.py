"""The ground of a world: carriageways, heights and kerbs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from worlds.shapes.polygons import Area, polygons_of
from worlds.shapes.semantics import GROUND_CLASSES
from worlds.shapes.structure_geometry import PartGeometry, StructureGeometry
from worlds.shapes.triangles import (
    from_above,
    quartered,
    turned_up,
    unit_normals,
)
from worlds.shapes.upper_sides import UpperSides

# Steeper surfaces are not ground: least z of the unit normal.
_LEAST_UP = 0.3
# Slits between triangles are closed up to twice this width [m].
_SEAM = 0.05
# Smaller islands and holes have no kerb of their own [m^2].
_LEAST_AREA = 4.0


class Kerb(NamedTuple):
    """A stretch of the edge of the carriageway.

    Attributes:
        points: (N, 2) points along the edge, in W [m].
        outwards: (N, 2) unit vectors at the points, away from the road.
    """

    points: np.ndarray
    outwards: np.ndarray


class GroundSurface:
    """The ground near a drive.

    Attributes:
        near: area in which the ground is known, seen from above [m].
    """

    def __init__(
        self,
        structures: Mapping[str, StructureGeometry],
        near: Area,
    ):
        """Collects the ground in an area.

        Args:
            structures: name -> geometry, for all structures of the world.
            near: area in which the ground is known, seen from above [m].
        """
        shapely.prepare(near)
        self.near = near
        corners = {of_road: [np.zeros((0, 3, 3))] for of_road in (False, True)}
        for structure in structures.values():
            if structure.semantic_class in GROUND_CLASSES:
                own = corners[structure.semantic_class == "road"]
                own += map(self._near_triangles, structure.parts)
        triangles = {k: np.concatenate(found) for k, found in corners.items()}
        self._roads = triangles[True]
        self._sides = {k: UpperSides(found) for k, found in triangles.items()}

    def _near_triangles(self, part: PartGeometry) -> np.ndarray:
        """Returns the corners (M, 3, 3) of triangles that are not steep [m]."""
        corners = turned_up(part.triangle_corners)
        middles = corners[:, :, :2].mean(axis=1)
        return corners[
            (unit_normals(corners)[:, 2] > _LEAST_UP)
            & shapely.contains_xy(self.near, middles)
        ]

    @classmethod
    def around(
        cls,
        structures: Mapping[str, StructureGeometry],
        places: np.ndarray,
        distance: float,
    ) -> GroundSurface:
        """Returns the ground in and around the bounding box of places (N, 2).

        Args:
            structures: name -> geometry, for all structures of the world.
            places: the places in W [m].
            distance: distance up to which the ground is known around them [m].
        """
        box = shapely.box(*places.min(axis=0), *places.max(axis=0))
        return cls(structures, box.buffer(distance))

    @cached_property
    def carriageway(self) -> Area:
        """The area of class `road`, seen from above [m]."""
        joined = shapely.unary_union(from_above(self._roads), grid_size=0.001)
        return joined.buffer(_SEAM).buffer(-_SEAM)

    def heights(
        self, xy: np.ndarray, *, of_road: bool | None = None
    ) -> np.ndarray:
        """Returns the heights (N,) of the ground [m]; NaN where there is none.

        Args:
            xy: (N, 2) places in W [m].
            of_road: True for the height of carriageways only, False for all
                other ground, and None for the higher of the two.
        """
        kinds = (False, True) if of_road is None else (of_road,)
        found = np.max([self._sides[k].heights(xy) for k in kinds], axis=0)
        return np.where(np.isfinite(found), found, np.nan)

    def levels(
        self, xy: np.ndarray, of_road: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns all heights of the ground at places, one above the other [m].

        Args:
            xy: (N, 2) places in W [m].
            of_road: whether the ground is the carriageway, or all other ground.

        Returns:
            (M,) the numbers of the places, and (M,) a height at each.
        """
        return self._sides[of_road].levels(xy)

    def lowest(self, area: Area, default: float) -> float:
        """Returns the least height of the ground at the corners of an area [m].

        The result is `default` if there is no ground at any corner.
        """
        z = self.heights(shapely.get_coordinates(area))
        z = z[np.isfinite(z)]
        return float(z.min()) if len(z) else default

    def rise(self, old: np.ndarray, new: np.ndarray) -> float:
        """Returns the rise of the ground from `old` to `new` [m].

        The result is 0 if there is no ground at one of these places.

        Args:
            old, new: (2,) places in W [m].
        """
        z = self.heights(np.array([old, new]))
        return float(z[1] - z[0]) if np.isfinite(z).all() else 0.0

    def is_below_road(self, part: PartGeometry) -> bool:
        """Returns whether a piece of ground continues below a carriageway."""
        corners = turned_up(part.triangle_corners)
        corners = corners[unit_normals(corners)[:, 2] > 0.0]
        inner = self.carriageway.buffer(-0.5)
        if inner.is_empty or len(corners) == 0:
            return False
        shapely.prepare(inner)
        return bool(shapely.intersects(from_above(corners), inner).any())

    def triangles_beside_road(
        self, corners: np.ndarray, fine: float
    ) -> np.ndarray:
        """Returns the parts of triangles beside the carriageway.

        Triangles that its edge crosses are divided; they become part of the
        result if their middle is beside the carriageway.

        Args:
            corners: (M, 3, 3) corners of triangles in W [m].
            fine: longest side of triangles that are divided no further [m].
        """
        corners = corners[shapely.intersects(from_above(corners), self.near)]
        road = self.carriageway
        shapely.prepare(road)
        done = [np.zeros((0, 3, 3))]
        while len(corners):
            areas = from_above(corners)
            meets = shapely.intersects(areas, road)
            done.append(corners[~meets])
            corners = corners[meets]
            corners = corners[~shapely.covers(road, areas[meets])]
            sides = np.linalg.norm(
                corners - np.roll(corners, -1, axis=1), axis=2
            ).max(axis=1)
            is_fine = sides <= fine
            last = corners[is_fine]
            middles = last[:, :, :2].mean(axis=1)
            done.append(last[~shapely.contains_xy(road, middles)])
            corners = quartered(corners[~is_fine])
        return np.concatenate(done)

    def kerbs(self, spacing: float) -> Iterator[Kerb]:
        """Yields the edges of the carriageway within the area `near`.

        The points of an edge are at most `spacing` apart [m].
        """
        inner = self.near.buffer(-1.0)  # The edge of `near` is not a kerb.
        shapely.prepare(inner)
        for polygon in polygons_of(self.carriageway):
            turned = orient(polygon)
            for ring in (turned.exterior, *turned.interiors):
                if shapely.Polygon(ring).area < _LEAST_AREA:
                    continue
                xy = shapely.get_coordinates(ring.segmentize(spacing))[:-1]
                yield from _kerbs_inside(xy, shapely.contains_xy(inner, xy))


def _kerbs_inside(xy: np.ndarray, inside: np.ndarray) -> Iterator[Kerb]:
    """Yields the stretches of a ring that are inside an area, as kerbs.

    The carriageway is on the left of the ring.
    """
    along = np.roll(xy, -1, axis=0) - np.roll(xy, 1, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    outwards = np.column_stack([along[:, 1], -along[:, 0]])
    if inside.all():
        order = np.append(np.arange(len(xy)), 0)
        yield Kerb(xy[order], outwards[order])
        return
    first = int(np.argmin(inside))
    order = np.roll(np.arange(len(xy)), -first)
    cuts = np.flatnonzero(np.diff(inside[order])) + 1
    # The first run is outside the area.
    for run in np.split(order, cuts)[1::2]:
        if len(run) >= 2:
            yield Kerb(xy[run], outwards[run])
