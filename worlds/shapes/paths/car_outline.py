"""The outline of a car, seen from above."""

import numpy as np
from numpy.typing import ArrayLike
import shapely
from shapely.geometry.base import BaseGeometry

# Length of the car behind the rear axle [m].
REAR = 1.0
# Length of the car ahead of the rear axle [m].
FRONT = 3.72
# Half the width of the car with mirrors [m].
HALF_WIDTH = 1.03


def swept_area(points: ArrayLike) -> BaseGeometry:
    """Returns the area that a car covers while its rear axle follows a path.

    `points` (N, 2) are closely spaced positions of the axle's middle on the
    path [m].
    """
    points = np.asarray(points, dtype=float)
    along = directions(points)
    return shapely.union_all(
        shapely.polygons(car_outlines(points, along, REAR, FRONT, HALF_WIDTH))
    )


def directions(points: np.ndarray) -> np.ndarray:
    """Returns the unit tangents (N, 2) of a path, at its points (N, 2)."""
    along = np.gradient(points, axis=0)
    along /= np.sqrt(along[:, :1] ** 2 + along[:, 1:] ** 2)
    return along


def car_outlines(
    places: np.ndarray,
    ahead: np.ndarray,
    rear: float | np.ndarray,
    front: float | np.ndarray,
    half_width: float | np.ndarray,
) -> np.ndarray:
    """Returns the corners (..., 4, 2) of cars seen from above [m].

    Args:
        places: (..., 2) positions of the cars' frames [m].
        ahead: (..., 2) unit vectors in which the cars point.
        rear, front: distances from the frames' origins to the rear and front
            ends of the cars, both positive [m]; a number, or (..., 1).
        half_width: half the width of the cars [m]; likewise.
    """
    left = np.stack([-ahead[..., 1], ahead[..., 0]], axis=-1)
    corners = [
        places + x * ahead + y * left
        for x, y in (
            (-rear, -half_width),
            (front, -half_width),
            (front, half_width),
            (-rear, half_width),
        )
    ]
    return np.stack(corners, axis=-2)
