"""Bays of parked cars: the room that a car has where it stands."""

from collections.abc import Mapping
import math

import numpy as np
import shapely
from shapely import Polygon

from evaluation.base import product
from worlds.shapes.obstacles import Obstacles
from worlds.shapes.structure_geometry import StructureGeometry

# Greatest free length of a bay in front of a car and behind it [m].
_LENGTHWISE = 0.5
# Greatest free width of a bay beside a car [m].
_SIDEWAYS = 0.25
# Greatest turn of a car relative to its bay [rad].
_SKEW = 0.03
# Distance between cars and all other objects [m].
_GAP = 0.05


class Bay:
    """The free rectangle around a parked car; bays do not overlap.

    Attributes:
        middle: (2,) middle of the car [m].
        yaw: heading of the bay's long axis [rad].
        reach: (4,) distances from the middle to the front, back, left and right
            end of the bay [m].
    """

    def __init__(self, car: StructureGeometry):
        """Makes a bay of the size of the car."""
        hull = shapely.MultiPoint(car.p_WPs[:, :2])
        corners = shapely.get_coordinates(hull.minimum_rotated_rectangle)[:4]
        sides = np.diff(corners, axis=0)[:2]
        lengths = np.linalg.norm(sides, axis=1)
        along = sides[int(lengths.argmax())]
        self.middle = corners.mean(axis=0)
        self.yaw = math.atan2(along[1], along[0])
        self.reach = np.repeat([lengths.max() / 2, lengths.min() / 2], 2)

    def box(self, beyond: np.ndarray | float = 0.0) -> Polygon:
        """Returns the rectangle of the bay as seen from above, enlarged [m].

        Args:
            beyond: lengths by which the bay is enlarged at the front, back,
                left and right, (4,), or one length for all sides [m].
        """
        front, back, left, right = self.reach + beyond
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        corners = np.array(
            [(front, left), (-back, left), (-back, -right), (front, -right)]
        )
        return Polygon(
            product(corners, np.array([[c, s], [-s, c]])) + self.middle
        )

    def grow(
        self,
        car: StructureGeometry,
        cars: Obstacles,
        others: Obstacles,
    ) -> None:
        """Enlarges the bay up to other objects, and halfway to other cars.

        The bay grows by at most 0.5 m in front and behind, and by at most 0.25
        m on each side.
        """
        own = (car.name,)
        box = self.box()
        growth = np.zeros(4)
        for k, most in enumerate((_LENGTHWISE,) * 2 + (_SIDEWAYS,) * 2):
            reach = np.zeros(4)
            reach[k] = 2 * most + _GAP
            around = self.box(reach)
            room = min(
                cars.distance(box, around, own) / 2,
                others.distance(box, around, own),
                most + _GAP,
            )
            growth[k] = max(room - _GAP, 0.0)
        self.reach = self.reach + growth

    def place(
        self, half_size: np.ndarray, rng: np.random.Generator
    ) -> tuple[np.ndarray, float] | None:
        """Returns a random place for a car in the bay.

        Args:
            half_size: (2,) half the length and half the width of the car [m].
            rng: the random generator.

        Returns:
            The middle (2,) [m] and yaw [rad] of the car; None if the car is too
            big for the bay.
        """
        skew = float(rng.uniform(-_SKEW, _SKEW))
        across = rng.uniform(size=2)
        turned = rng.uniform() < 0.5
        c, s = math.cos(skew), abs(math.sin(skew))
        half = half_size * c + half_size[::-1] * s
        low, high = half - self.reach[1::2], self.reach[::2] - half
        if (low > high).any():
            return None
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        x, y = low + across * (high - low)
        offset = np.array([c * x - s * y, s * x + c * y])
        yaw = self.yaw + skew + np.pi * turned
        return self.middle + offset, float(yaw)


def grown_bays(
    cars: Mapping[str, StructureGeometry], others: Obstacles
) -> dict[str, Bay]:
    """Returns name -> bay, for all of some parked cars.

    Args:
        cars: name -> car.
        others: what stands around them.
    """
    bays = {name: Bay(car) for name, car in cars.items()}
    if not bays:
        return {}
    standing = Obstacles((n, bay.box()) for n, bay in bays.items())
    grown = {}
    for name, car in cars.items():
        grown[name] = Bay(car)
        grown[name].grow(car, standing, others)
    # Two bays that meet at a corner both keep their size.
    boxes = [bay.box() for bay in grown.values()]
    names = list(grown)
    first, second = shapely.STRtree(boxes).query(boxes, "intersects")
    for a, b in zip(first, second, strict=True):
        if a != b:
            grown[names[a]] = bays[names[a]]
    return grown
