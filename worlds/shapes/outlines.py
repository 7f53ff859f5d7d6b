"""Outlines of buildings, and how they are inset, cut and rounded.

An outline is (N, 2) corners [m], counter-clockwise, with the front edge first.
"""

from collections.abc import Callable, Collection
import math

import numpy as np
from numpy.typing import ArrayLike

from evaluation.base import cos, dot, sin

# x and y [m].
Point = tuple[float, float]
# Corners, each an array of x and y [m].
Corners = list[np.ndarray]
# Rectangle along the axes: x0, y0, x1 and y1 [m].
Area = tuple[float, float, float, float]


def rectangle(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    """Returns the corners (4, 2) of a rectangle [m], first the edge at y0."""
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=float)


def regular_polygon(
    radius: float,
    count: int,
    center: ArrayLike = (0.0, 0.0),
    phase: float = 0.0,
) -> np.ndarray:
    """Returns the corners (count, 2) of a regular polygon [m].

    Args:
        radius: distance of the corners from the centre [m].
        count: number of corners.
        center: x and y of the centre [m].
        phase: direction from the centre to the first corner [rad].
    """
    angles = phase + np.arange(count) * 2 * math.pi / count
    return np.asarray(center) + radius * np.column_stack(
        [cos(angles), sin(angles)]
    )


def square(x: float, y: float, half: float) -> np.ndarray:
    """Returns the corners (4, 2) of a square with the centre (x, y) [m].

    `half` is half the length of a side.
    """
    return rectangle(x - half, y - half, x + half, y + half)


def inset(points: ArrayLike, distance: ArrayLike) -> np.ndarray:
    """Returns an outline with each edge moved inwards.

    The corners keep their order.

    Args:
        points: (N, 2) corners of the outline, counter-clockwise [m].
        distance: one number for all edges, or (N,) one for each edge [m]; a
            negative distance moves an edge outwards. Distances must be small
            compared with the lengths of the edges.
    """
    points = np.asarray(points, dtype=float)
    distances = np.broadcast_to(np.asarray(distance, float), len(points))
    along = np.roll(points, -1, axis=0) - points
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    moved = np.empty_like(points)
    for k, p in enumerate(points):
        (ax, ay), (bx, by) = a, b = along[k - 1], along[k]
        sine = ax * by - ay * bx
        if abs(sine) < 1e-9:  # The two edges are one line.
            moved[k] = p + distances[k] * np.array([-by, bx])
        else:
            moved[k] = p + (b * distances[k - 1] - a * distances[k]) / sine
    return moved


def inset_limit(points: ArrayLike) -> float:
    """Returns the smallest inset at which an edge loses 70 % of its length [m].

    `points` contains the corners (N, 2) of an outline [m].
    """
    points = np.asarray(points, dtype=float)
    probe = 1e-3
    length = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    moved = inset(points, probe)
    after = np.linalg.norm(np.roll(moved, -1, axis=0) - moved, axis=1)
    loss = np.maximum((length - after) / probe, 1e-9)
    return float((0.7 * length / loss).min())


def rounded(
    points: ArrayLike, corners: dict[int, float], step: float
) -> np.ndarray:
    """Returns an outline whose convex corners are rounded by chords.

    The first edge of the result is the part of the outline's first edge that
    remains between the arcs.

    Args:
        points: (N, 2) corners of the outline [m].
        corners: number of a corner -> radius of the corner [m]; all other
            corners stay unchanged.
        step: greatest length of a chord [m].
    """

    def arc(
        k: int, p: np.ndarray, into: np.ndarray, out: np.ndarray
    ) -> Corners:
        radius = corners[k]
        cross = into[0] * out[1] - into[1] * out[0]
        turn = math.atan2(cross, float(dot(into, out)))
        center = (
            p
            - into * radius * math.tan(turn / 2)
            + radius * np.array([-into[1], into[0]])
        )
        start = math.atan2(-into[0], into[1])
        count = max(1, math.ceil(radius * turn / step))
        angles = (start + turn * i / count for i in range(count + 1))
        return [
            center + radius * np.array([math.cos(a), math.sin(a)])
            for a in angles
        ]

    return _with_replaced_corners(points, arc, corners)


def shortest_side(points: ArrayLike) -> float:
    """Returns the shorter side of an outline's bounding box [m]."""
    span = np.ptp(np.asarray(points, dtype=float), axis=0)
    return float(min(span))


def extent(points: np.ndarray) -> Area:
    """Returns x0, y0, x1, y1 of an outline's bounding box [m]."""
    return (*points.min(axis=0), *points.max(axis=0))


def chamfered(points: np.ndarray, cut: float) -> np.ndarray:
    """Returns an outline (M, 2) with its convex corners cut off [m].

    Each cut starts `cut` metres from the corner on both edges.
    """
    return _with_replaced_corners(
        points, lambda k, p, a, b: [p - a * cut, p + b * cut]
    )


def notched(points: np.ndarray, depth: float) -> np.ndarray:
    """Returns an outline (M, 2) with its convex corners notched [m].

    A square with the side `depth` is cut out of each convex corner.
    """
    d = depth
    return _with_replaced_corners(
        points, lambda k, p, a, b: [p - a * d, p - a * d + b * d, p + b * d]
    )


def _with_replaced_corners(
    points: ArrayLike,
    corner: Callable[[int, np.ndarray, np.ndarray, np.ndarray], Corners],
    chosen: Collection[int] | None = None,
) -> np.ndarray:
    """Returns an outline with several corners in place of some corners.

    The corners whose numbers are in `chosen` are replaced; by default, all
    convex corners. The function `corner` takes a corner's number, its place,
    and the directions of the edges before and after the corner, and returns the
    new corners. The first edge of the outline stays the first edge.
    """
    points = np.asarray(points, dtype=float)
    result: Corners = []
    for k, p in enumerate(points):
        a = p - points[k - 1]
        b = points[(k + 1) % len(points)] - p
        a, b = a / np.hypot(*a), b / np.hypot(*b)
        if chosen is None:
            replace = a[0] * b[1] - a[1] * b[0] > 0.1
        else:
            replace = k in chosen
        result.extend(corner(k, p, a, b) if replace else [p])
        if k == 0:
            front = len(result) - 1
    return np.roll(np.array(result), -front, axis=0)


def stadium(
    x0: float, y0: float, x1: float, y1: float, step: float = 3.0
) -> np.ndarray:
    """Returns the outline (N, 2) of a rectangle with half circles as ends [m].

    The longer sides of the rectangle are along x.

    Args:
        x0: left end [m].
        y0: front [m].
        x1: right end [m].
        y1: back [m].
        step: longest chord of the half circles [m].
    """
    radius, middle = (y1 - y0) / 2, (y0 + y1) / 2
    count = max(2, math.ceil(math.pi * radius / step))
    angles = np.linspace(-math.pi / 2, math.pi / 2, count + 1)
    arc = radius * np.column_stack([cos(angles), sin(angles)])
    right = np.array([x1 - radius, middle]) + arc
    left = np.array([x0 + radius, middle]) - arc
    # The arc on the left ends where the front begins.
    return np.roll(np.vstack([right, left]), 1, axis=0)


def u_shape(
    x0: float, y0: float, x1: float, y1: float, wing: float, back: float
) -> np.ndarray:
    """Returns the outline (8, 2) of a U, whose court is open to the back [m].

    Args:
        x0, y0, x1, y1: see `stadium`.
        wing: width of the two wings, left and right of the court [m].
        back: depth of the part that joins the wings, in front of the court [m].
    """
    a, b, c = x0 + wing, x1 - wing, y0 + back
    xs = (x0, x1, x1, b, b, a, a, x0)
    return np.column_stack([xs, (y0, y0, y1, y1, c, c, y1, y1)])


def l_shape(
    x0: float, y0: float, x1: float, y1: float, wing: float, back: float
) -> np.ndarray:
    """Returns the outline (6, 2) of an L: a front part and a left wing [m].

    Args:
        x0, y0, x1, y1: see `stadium`.
        wing: width of the wing behind the front part [m].
        back: depth of the front part [m].
    """
    a, c = x0 + wing, y0 + back
    return np.column_stack([(x0, x1, x1, a, a, x0), (y0, y0, c, c, y1, y1)])


def mirrored(points: np.ndarray) -> np.ndarray:
    """Returns an outline (N, 2) mirrored left to right at its middle.

    The front edge is still the first edge, and the corners are still
    counter-clockwise.
    """
    points = np.asarray(points, dtype=float)
    middle = (points[:, 0].min() + points[:, 0].max()) / 2
    flipped = np.column_stack([2 * middle - points[:, 0], points[:, 1]])
    # Mirroring turns it clockwise; the front edge stays first.
    return np.roll(flipped[::-1], 2 - len(points), axis=0)


def edges_on(
    plan: np.ndarray, outline: np.ndarray, edges: Collection[int]
) -> frozenset[int]:
    """Returns which edges of a plan lie along given edges of an outline.

    Args:
        plan: (M, 2) corners of the plan [m].
        outline: (N, 2) corners of the outline [m].
        edges: numbers of the outline's edges.

    Returns:
        Numbers of the plan's edges that are at most 1 cm from the straight line
        through one of the given edges.
    """
    found = set()
    ends = np.roll(plan, -1, axis=0)
    for k, (a, b) in enumerate(zip(plan, ends, strict=True)):
        for edge in edges:
            start = outline[edge]
            along = outline[(edge + 1) % len(outline)] - start
            normal = np.array([-along[1], along[0]]) / np.hypot(*along)
            if np.abs(dot(np.array([a, b]) - start, normal)).max() < 0.01:
                found.add(k)
    return frozenset(found)
