"""Pictures of large point clouds, drawn by NumPy.

Millions of points are projected orthographically, hidden ones removed by a
depth buffer, and edges darkened where the depth steps (eye-dome lighting:
Boucheny 2009), which shows shape without normals.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from cns_drake.base.compiled import compiled

_WHITE = 255
# Strength of the darkening: a step of one metre darkens by 1 - exp(-strength).
_STEP_STRENGTH = 0.35
# Deeper steps darken no more than this [m].
_STEP_LIMIT = 4.0


@dataclass(frozen=True)
class View:
    """An orthographic camera that looks at the ground.

    Attributes:
        azimuth_deg: direction from the scene to the camera, seen from above
            [deg].
        elevation_deg: of the camera above the horizon, up to 90 [deg].
        pixels_per_metre: scale.
    """

    azimuth_deg: float = -60.0
    elevation_deg: float = 35.0
    pixels_per_metre: float = 3.0

    def axes(self) -> np.ndarray:
        """Returns rows right, up and towards the camera (3, 3), in W."""
        azimuth = math.radians(self.azimuth_deg)
        elevation = math.radians(self.elevation_deg)
        towards = [
            math.cos(elevation) * math.cos(azimuth),
            math.cos(elevation) * math.sin(azimuth),
            math.sin(elevation),
        ]
        right = [-math.sin(azimuth), math.cos(azimuth), 0.0]
        return np.array([right, np.cross(towards, right), towards])


@dataclass(frozen=True)
class Picture:
    """A rendered cloud.

    Attributes:
        image: (height, width, 3) uint8; white where there is no point.
        origin: coordinates along right and up of the lower left corner [m].
        view: how it was taken.
    """

    image: np.ndarray
    origin: np.ndarray
    view: View

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of the image, along its axes [m]."""
        height, width = self.image.shape[:2]
        scale = self.view.pixels_per_metre
        left, bottom = self.origin
        return left, left + width / scale, bottom, bottom + height / scale

    def project(self, points: np.ndarray) -> np.ndarray:
        """Returns points (N, 3) along right and up (N, 2) [m]."""
        return points @ self.view.axes()[:2].T


def render(
    points: np.ndarray, rgb: np.ndarray, view: View, size_px: int = 3
) -> Picture:
    """Draws a cloud.

    Args:
        points: (N, 3) in W [m], N > 0.
        rgb: (N, 3) uint8 colour of each.
        view: the camera.
        size_px: side of the square that a point covers.
    """
    seen = points @ view.axes().T
    # One column at a time: a minimum over rows takes many times as long.
    origin = np.array([seen[:, 0].min(), seen[:, 1].min()])
    column, up = (
        np.floor((seen[:, :2] - origin) * view.pixels_per_metre)
        .astype(np.int64)
        .T
    )
    width = int(column.max()) + size_px
    height = int(up.max()) + size_px
    depth = np.full((height, width), -np.inf)
    frontmost = np.full((height, width), -1, np.int32)
    _cover(column, height - size_px - up, seen, size_px, depth, frontmost)
    filled = frontmost >= 0
    nearest = frontmost[filled]
    image = np.full((height, width, 3), _WHITE, dtype=np.uint8)
    image[filled] = (rgb[nearest] * _shade(depth)[filled, None]).astype(
        np.uint8
    )
    return Picture(image, origin, view)


@compiled
def _cover(
    column: np.ndarray,
    row: np.ndarray,
    seen: np.ndarray,
    size_px: int,
    depth: np.ndarray,
    frontmost: np.ndarray,
) -> None:
    """Draws the square of each point; of equally deep ones the last stays.

    Args:
        column: (N,) of the left side of each square.
        row: (N,) of its top.
        seen: (N, 3), towards the camera in the end.
        size_px: side of the squares.
        depth: (H, W) buffer to fill.
        frontmost: (H, W) the point at each pixel, to fill.
    """
    for k in range(len(seen)):
        for i in range(row[k], row[k] + size_px):
            for j in range(column[k], column[k] + size_px):
                if seen[k, 2] >= depth[i, j]:
                    depth[i, j] = seen[k, 2]
                    frontmost[i, j] = k


def shade_by_height(
    rgb: np.ndarray, heights: np.ndarray, darkest: float = 0.75
) -> np.ndarray:
    """Returns colours that are darker the lower their points are.

    Args:
        rgb: (N, 3) uint8.
        heights: (N,) [m].
        darkest: factor at the lowest point.
    """
    factor = darkest + (1.0 - darkest) * _height_parts(heights)
    return (rgb * factor[:, None]).astype(np.uint8)


def colour_by_height(
    heights: np.ndarray,
    lowest: tuple[int, int, int],
    highest: tuple[int, int, int],
) -> np.ndarray:
    """Returns colours (N, 3) uint8 between two by height.

    Args:
        heights: (N,) [m].
        lowest: colour of the lowest point.
        highest: colour of the highest.
    """
    part = _height_parts(heights)[:, None]
    return ((1.0 - part) * lowest + part * highest).astype(np.uint8)


def _height_parts(heights: np.ndarray) -> np.ndarray:
    """Returns 0 for low points to 1 for high ones; stray ones do not count."""
    # A river's bed is up to 5 %, and must be no brighter than streets.
    low, high = np.quantile(heights, [0.05, 0.99])
    part = np.clip((heights - low) / max(high - low, 1e-9), 0.0, 1.0)
    # The square root spreads low heights, because most of a city is near the
    # ground.
    return np.sqrt(part)


def _shade(depth: np.ndarray) -> np.ndarray:
    """Returns the brightness of each pixel, 0 to 1, from steps in depth.

    It is NaN where there is nothing.

    Args:
        depth: (H, W) towards the camera [m]; -inf where there is nothing.
    """
    padded = np.pad(depth, 1, constant_values=-np.inf)
    height, width = depth.shape
    steps = np.zeros_like(depth)
    neighbours = [
        (0, 1),
        (1, 0),
        (1, 2),
        (2, 1),
        (0, 0),
        (0, 2),
        (2, 0),
        (2, 2),
    ]
    for row, column in neighbours:
        other = padded[row : row + height, column : column + width]
        with np.errstate(invalid="ignore"):
            steps += np.clip(other - depth, 0.0, _STEP_LIMIT)
    return np.exp(-_STEP_STRENGTH * steps / len(neighbours))
