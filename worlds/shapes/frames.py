"""Frames on the ground, along which objects are placed."""

from dataclasses import dataclass
import math

import numpy as np
from shapely import Polygon

from worlds.shapes.models import Model
from worlds.shapes.polygons import Area, placed


@dataclass
class GroundFrame:
    """A frame on the ground, seen from above.

    Attributes:
        middle: (2,) origin of the frame in W [m].
        yaw: heading of the x axis in W [rad].
    """

    middle: np.ndarray
    yaw: float

    def place(self, x: float, y: float) -> np.ndarray:
        """Converts a point (x, y) from the frame to W, (2,) [m]."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return self.middle + np.array([c * x - s * y, s * x + c * y])

    def rectangle(
        self, x: float, length: float, y0: float, y1: float
    ) -> Polygon:
        """Returns a rectangle along the frame's axes, as a polygon in W [m].

        It is `length` long along x, with its middle at `x`. Along y, it extends
        from `y0` to `y1`.
        """
        x0, x1 = x - length / 2, x + length / 2
        return Polygon(
            [self.place(*at) for at in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
        )

    def footprint(
        self, model: Model, x: float, y: float, turn: float = 0.0
    ) -> Area:
        """Returns the footprint of a model in W [m].

        `x` and `y` [m] are the place of the model in the frame, and `turn`
        [rad] is its heading in this frame.
        """
        at = self.place(x, y).tolist()
        return placed(model.footprint, at, turn + self.yaw)
