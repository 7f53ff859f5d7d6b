"""Plots of land, each of which is the ground of one building."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
import shapely
from shapely import affinity
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from worlds.shapes import Model, Structure, largest_rectangle

# Neighbours closer than this have blank walls towards each other [m].
PARTY_WALL = 3.1


@dataclass(frozen=True)
class Plot:
    """The ground of one building.

    The x axis of the plot's frame S runs along the street, and its y axis
    points away from the street.

    Attributes:
        area: area of the plot in W [m].
        xy: origin of S in W [m].
        yaw: heading of the x axis of S [rad].
        z: height of the ground [m].
    """

    area: BaseGeometry
    xy: tuple[float, float]
    yaw: float
    z: float

    @classmethod
    def facing(
        cls, area: BaseGeometry, streets: BaseGeometry, z: float
    ) -> Plot:
        """Returns the plot on an area in W [m], with its front to a street.

        The front faces the street that is nearest to the area. `z` is the
        height of the ground [m].
        """
        rectangle = shapely.orient_polygons(area.minimum_rotated_rectangle)
        corners = shapely.get_coordinates(rectangle)
        middles = shapely.points((corners[:-1] + corners[1:]) / 2)
        shapely.prepare(streets)
        k = int(np.argmin(shapely.distance(middles, streets).round(2)))
        along = corners[k + 1] - corners[k]
        x, y = area.centroid.coords[0]
        xy = (round(float(x), 3), round(float(y), 3))
        yaw = round(math.atan2(along[1], along[0]), 5)
        return cls(area, xy, yaw, round(z, 3))

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Converts a point in S to W [m], rounded to millimetres."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return (
            round(self.xy[0] + c * x - s * y, 3),
            round(self.xy[1] + s * x + c * y, 3),
        )

    def inside(self, area: BaseGeometry) -> BaseGeometry:
        """Converts an area from the world W to the plot's frame S."""
        moved = affinity.translate(area, -self.xy[0], -self.xy[1])
        return affinity.rotate(moved, -self.yaw, (0, 0), use_radians=True)

    def triangles(self, p_W: np.ndarray) -> np.ndarray:
        """Converts triangles `p_W` (M, 3, 3) from the world W to S [m].

        Heights in S are above the plot's ground.
        """
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        x, y, z = np.moveaxis(p_W - [*self.xy, self.z], -1, 0)
        return np.stack([c * x + s * y, c * y - s * x, z], axis=-1)

    def room(self) -> Polygon:
        """Returns a large rectangle inside the plot, in S [m]."""
        return largest_rectangle(self.inside(self.area))

    def structure(
        self, name: str, semantic_class: str, model: Model
    ) -> Structure:
        """Returns a structure that stands on the plot.

        Args:
            name: name of the structure.
            semantic_class: class of the structure.
            model: shape of the structure, expressed in S.
        """
        return Structure(
            name, semantic_class, model, (*self.xy, self.z), self.yaw
        )


def building_plot(building: Structure) -> Plot:
    """Returns the plot of land that a building's footprint covers."""
    area = building.footprint_W
    return Plot(area, building.xyz[:2], building.yaw, building.xyz[2])
