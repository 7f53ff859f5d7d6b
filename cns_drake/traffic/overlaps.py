"""Finds overlapping boxes."""

from typing import Any

import numpy as np

from cns_drake.base import compiled


@compiled
def boxes_overlap(a: Any, b: Any, half_a: Any, half_b: Any) -> bool:
    """Returns whether two rectangles a and b overlap.

    Two rectangles overlap if their projections on the axes of both rectangles
    overlap.

    Args:
        a, b: x and y of each centre [m], and heading [rad], (3,).
        half_a, half_b: half of each length and width [m], (2,).
    """
    dx, dy = b[0] - a[0], b[1] - a[1]
    square = (half_a[0] + half_b[0]) ** 2 + (half_a[1] + half_b[1]) ** 2
    # The half diagonals together are at most sqrt(2) times as long as this.
    if dx**2 + dy**2 > 2.0 * square:
        return False
    turn = b[2] - a[2]
    c, s = abs(np.cos(turn)), abs(np.sin(turn))
    for heading, first, second in (
        (a[2], half_a, half_b),
        (b[2], half_b, half_a),
    ):
        x, y = np.cos(heading), np.sin(heading)
        reach = first[0] + second[0] * c + second[1] * s
        if reach - abs(dx * x + dy * y) <= 0.0:
            return False
        reach = first[1] + second[0] * s + second[1] * c
        if reach - abs(dx * -y + dy * x) <= 0.0:
            return False
    return True


@compiled
def find_overlaps(
    poses: np.ndarray, half: np.ndarray, found: np.ndarray
) -> None:
    """Finds the pairs of bodies that overlap at any of several times.

    Args:
        poses: (K, N, 3) x, y [m] and heading [rad] of N bodies at K times; NaN
            while a body is absent.
        half: (N, 2) half of each body's length and width [m].
        found: (N, N) bool; set to True for each pair that overlaps.
    """
    reach = np.sqrt(half[:, 0] ** 2 + half[:, 1] ** 2)
    for k in range(len(poses)):
        for i in range(len(half)):
            x, y = poses[k, i, 0], poses[k, i, 1]
            for j in range(i):
                dx, dy = poses[k, j, 0] - x, poses[k, j, 1] - y
                far = reach[i] + reach[j]
                # The comparison is False for NaN as well.
                if (
                    dx * dx + dy * dy < far * far
                    and not found[i, j]
                    and boxes_overlap(
                        poses[k, i], poses[k, j], half[i], half[j]
                    )
                ):
                    found[i, j] = found[j, i] = True
