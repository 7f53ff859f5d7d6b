"""Renders a cloud of points as a picture.

Millions of points are projected orthographically, and occluded points are
removed by a depth buffer. Edges are darkened where the depth steps (eye-dome
lighting: Boucheny 2009). The dark edges show shapes without normals.
"""

from dataclasses import dataclass, replace
import math

import numpy as np
from scipy.ndimage import maximum_filter

_WHITE = 255
# Strength of the darkening: a step of one metre darkens by 1 - exp(-strength).
_STEP_STRENGTH = 0.35
# Deeper steps darken no more than this [m].
_STEP_LIMIT = 4.0
# Greatest picture [pixels]: 1.2 km of city in the oblique view, at 4 pixels a
# metre. Drawing takes some 40 bytes a pixel, and drives may be far apart.
_MOST_PIXELS = 1 << 25
# Greatest side of a picture [pixels], which is that of the format WebP.
_LONGEST_SIDE = 16383


@dataclass(frozen=True)
class OrthographicView:
    """An orthographic camera that looks at the ground.

    Attributes:
        azimuth_deg: direction from the scene to the camera, seen from above,
            anticlockwise from the x axis [deg].
        elevation_deg: angle of the camera above the horizon, up to 90 [deg].
        pixels_per_metre: scale of the picture.
    """

    azimuth_deg: float = -60.0
    elevation_deg: float = 35.0
    pixels_per_metre: float = 3.0

    def axes(self) -> np.ndarray:
        """Returns the directions right, up and towards the camera in W, (3, 3).

        Each row is a unit vector.
        """
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
    """An image of a cloud, white where it is empty.

    Attributes:
        image: (height, width, 3) uint8 pixels.
        origin: (2,) position of the image's lower left corner, along axes that
            point to the right and upwards in the image [m].
        view: the camera.
    """

    image: np.ndarray
    origin: np.ndarray
    view: OrthographicView

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of the image, along its axes [m]."""
        height, width = self.image.shape[:2]
        scale = self.view.pixels_per_metre
        left, bottom = self.origin
        return left, left + width / scale, bottom, bottom + height / scale

    def project(self, points: np.ndarray) -> np.ndarray:
        """Projects points (N, 3) onto the image plane; returns (N, 2) [m].

        The two coordinates point right and up.
        """
        return points @ self.view.axes()[:2].T


def render(
    points: np.ndarray,
    rgb: np.ndarray,
    view: OrthographicView,
    size_px: int = 3,
    most_px: int = _MOST_PIXELS,
) -> Picture:
    """Draws a cloud as an orthographic picture, with edges darkened.

    Args:
        points: (N, 3) points in W [m], N > 0.
        rgb: (N, 3) uint8 colours.
        view: direction and scale of the picture. The scale becomes smaller if
            the picture would be too large.
        size_px: side of the square that each point covers [pixels].
        most_px: greatest size of the picture; each side fits into a WebP.
    """
    seen = points @ view.axes().T
    # One column at a time: a minimum over rows takes many times as long.
    origin = np.array([seen[:, 0].min(), seen[:, 1].min()])
    extent = np.array([seen[:, 0].max(), seen[:, 1].max()]) - origin
    greatest = _greatest_scale(extent, size_px, most_px)
    scale = min(view.pixels_per_metre, greatest)
    view = replace(view, pixels_per_metre=scale)
    column, up = (
        np.floor((seen[:, :2] - origin) * view.pixels_per_metre)
        .astype(np.int64)
        .T
    )
    width = int(column.max()) + size_px
    height = int(up.max()) + size_px
    # The number of each pixel's point, from the farthest to the nearest: where
    # several have the same pixel, NumPy keeps the last.
    order = np.argsort(seen[:, 2], kind="stable")
    corners = np.full((height, width), -1, np.int32)
    corners[height - size_px - up[order], column[order]] = np.arange(len(order))
    # A square lies below and right of its corner.
    nearest = maximum_filter(
        corners, size_px, origin=(size_px - 1) // 2, mode="constant", cval=-1
    )
    filled = nearest >= 0
    front = order[nearest[filled]]
    # With a rim of one pixel.
    depth = np.full((height + 2, width + 2), -np.inf)
    depth[1:-1, 1:-1][filled] = seen[front, 2]
    image = np.full((height, width, 3), _WHITE, dtype=np.uint8)
    image[filled] = (rgb[front] * _shade(depth)[filled, None]).astype(np.uint8)
    return Picture(image, origin, view)


def _greatest_scale(extent: np.ndarray, size_px: int, most_px: int) -> float:
    """Returns the scale of the greatest picture that is allowed [pixels/m].

    Args:
        extent: (2,) width and height of the cloud in the picture [m].
        size_px, most_px: see `render`.
    """
    width, height = extent.tolist()
    # The root s of (width s + size_px) (height s + size_px) = most_px, in the
    # form that holds for a line, too.
    linear = size_px * (width + height)
    rest = most_px - size_px**2
    root = math.sqrt(linear**2 + 4.0 * width * height * rest)
    longest = max(width, height, 1e-9)
    return min(
        2.0 * rest / max(linear + root, 1e-9),
        (_LONGEST_SIDE - size_px) / longest,
    )


def shade_by_height(
    rgb: np.ndarray, heights: np.ndarray, darkest: float = 0.75
) -> np.ndarray:
    """Returns colours (N, 3) uint8 that are darker for lower points.

    Args:
        rgb: (N, 3) uint8 colours.
        heights: (N,) heights [m].
        darkest: factor by which the colour of the lowest points is multiplied.
    """
    factor = darkest + (1.0 - darkest) * _height_parts(heights)
    return (rgb * factor[:, None]).astype(np.uint8)


def colour_by_height(
    heights: np.ndarray,
    lowest: tuple[int, int, int],
    highest: tuple[int, int, int],
) -> np.ndarray:
    """Returns colours (N, 3) uint8, blended between two colours by height.

    Args:
        heights: (N,) heights [m].
        lowest: colour of the lowest points, red, green and blue.
        highest: colour of the highest points.
    """
    part = _height_parts(heights)[:, None]
    return ((1.0 - part) * lowest + part * highest).astype(np.uint8)


def _height_parts(heights: np.ndarray) -> np.ndarray:
    """Returns heights scaled from 0 (low) to 1 (high), ignoring outliers."""
    # Up to 5 % of the points are a river's bed, which must not be brighter than
    # streets.
    low, high = np.quantile(heights, [0.05, 0.99])
    part = np.clip((heights - low) / max(high - low, 1e-9), 0.0, 1.0)
    # The square root spreads low heights, because most of a city is near the
    # ground.
    return np.sqrt(part)


def _shade(depth: np.ndarray) -> np.ndarray:
    """Returns the brightness of each pixel, 0 to 1, from steps in depth [m].

    The depth, which has a rim of one pixel more, is -inf, and the brightness
    NaN, where there is nothing.
    """
    inner = depth[1:-1, 1:-1]
    height, width = inner.shape
    steps = np.zeros_like(inner)
    sides = [(0, 1), (1, 0), (1, 2), (2, 1)]
    corners = [(0, 0), (0, 2), (2, 0), (2, 2)]
    neighbours = sides + corners
    for row, column in neighbours:
        other = depth[row : row + height, column : column + width]
        with np.errstate(invalid="ignore"):
            step = other - inner
        steps += np.clip(step, 0.0, _STEP_LIMIT, out=step)
    return np.exp(-_STEP_STRENGTH * steps / len(neighbours))
