"""Rays along the axes of capsules, in closed form.

Embree's rounded segments lose most rays that point along their axis, up to an
angle of 1e-3 rad. Only rays that start in line with a capsule can be of these.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.scene.surfaces import CapsuleSurface

if TYPE_CHECKING:
    from cns_drake.ray_casting.moving_groups import Placed
    from cns_drake.ray_casting.ray_groups import RayGroup
    from cns_drake.ray_casting.rays import Hits, Rays

# Sine of the angle up to which rays are cast here.
_ALONG = 5e-3
# What is nearer by less than this is the same hit [m].
_SAME = 1e-4


class _Capsules(NamedTuple):
    """C capsules, each in the frame L of its group.

    Attributes:
        groups: (C,) row of its group.
        owners: (C,) int32 index of its geometry.
        p_LCs: (C, 3) its middle [m].
        axes: (C, 3) its unit axis.
        halves: (C,) half of the length of its straight part [m].
        radii: (C,) [m].
    """

    groups: np.ndarray
    owners: np.ndarray
    p_LCs: np.ndarray
    axes: np.ndarray
    halves: np.ndarray
    radii: np.ndarray


class CapsuleAxes:
    """The capsules of groups, for rays along their axes."""

    def __init__(self, groups: Sequence[RayGroup]):
        """Takes groups that are placed."""
        found = [
            (row, index, X_LG, surface)
            for row, group in enumerate(groups)
            for index, X_LG, surface in group.members
            if isinstance(surface, CapsuleSurface)
        ]
        self._capsules = _Capsules(
            np.array([row for row, *_ in found], np.int32),
            np.array([index for _, index, *_ in found], np.int32),
            np.reshape([X.translation() for *_, X, _ in found], (-1, 3)),
            np.reshape(
                [X.rotation().matrix()[:, 2] for *_, X, _ in found], (-1, 3)
            ),
            np.array([one.length / 2.0 for *_, one in found], float),
            np.array([one.radius for *_, one in found], float),
        )
        self._X_OLs = np.reshape([group.X_OL for group in groups], (-1, 3, 4))
        self._is_still = np.array(
            [group.in_sight and group.motion is None for group in groups], bool
        )

    def place(self, placed: Placed) -> None:
        """Moves groups to their places."""
        if len(self._capsules.groups):
            _place(placed, self._X_OLs, self._is_still)

    def cast(self, rays: Rays, hits: Hits) -> None:
        """Updates `hits` where rays along an axis meet its capsule first.

        Capsules that move during the turn are left out.
        """
        if len(self._capsules.groups):
            _cast(self._capsules, self._X_OLs, self._is_still, rays, hits)


@compiled
def _place(placed: Placed, X_OLs: np.ndarray, is_still: np.ndarray) -> None:
    """Updates the places of groups; NumPy takes ten times as long."""
    for k in range(len(placed.rows)):
        row = placed.rows[k]
        is_still[row] = placed.in_sight[k] and not placed.moves[k]
        for i in range(3):
            for j in range(4):
                X_OLs[row, i, j] = placed.X_OLs[k, i, j]


@compiled
def _cast(
    capsules: _Capsules,
    X_OLs: np.ndarray,
    is_still: np.ndarray,
    rays: Rays,
    hits: Hits,
) -> None:
    """Finds the capsules that rays along their axes can meet, and casts these.

    All such rays start in a cone about the axis.
    """
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for k in range(len(rays.p_OSset)):
        for i in range(3):
            low[i] = min(low[i], rays.p_OSset[k, i])
            high[i] = max(high[i], rays.p_OSset[k, i])
    spread = 0.0
    for i in range(3):
        spread += ((high[i] - low[i]) / 2.0) ** 2
    spread = np.sqrt(spread)
    # Middle of the origins in the frame of a group.
    p_LM, last = np.zeros(3), -1
    for k in range(len(capsules.groups)):
        group = capsules.groups[k]
        if not is_still[group]:
            continue
        if group != last:
            last = group
            for n in range(3):
                p_LM[n] = 0.0
                for i in range(3):
                    away = (low[i] + high[i]) / 2.0 - X_OLs[group, i, 3]
                    p_LM[n] += X_OLs[group, i, n] * away
        along = square = 0.0
        for n in range(3):
            away = p_LM[n] - capsules.p_LCs[k, n]
            along += away * capsules.axes[k, n]
            square += away**2
        reach = capsules.radii[k] + spread
        reach += 2.0 * _ALONG * (np.sqrt(square) + spread + capsules.halves[k])
        if square - along**2 <= reach**2:
            _cast_on_one(capsules, k, X_OLs[group], rays, hits)


@compiled
def _cast_on_one(
    capsules: _Capsules,
    k: int,
    X_OL: np.ndarray,
    rays: Rays,
    hits: Hits,
) -> None:
    """Casts the rays along the axis of a capsule.

    Args:
        capsules: all of them.
        k: which one.
        X_OL: (3, 4) of its group.
        rays: N of them.
        hits: their hits so far, to update.
    """
    half, radius = capsules.halves[k], capsules.radii[k]
    away, d, p_OC, axis = np.zeros((4, 3))
    for i in range(3):
        p_OC[i] = X_OL[i, 3]
        for n in range(3):
            p_OC[i] += X_OL[i, n] * capsules.p_LCs[k, n]
            axis[i] += X_OL[i, n] * capsules.axes[k, n]
    for ray in range(len(rays.d_Sset)):
        R = rays.R_OSset[ray % len(rays.R_OSset)]
        d_S = rays.d_Sset[ray]
        d_along = 0.0
        for i in range(3):
            d[i] = R[i, 0] * d_S[0] + R[i, 1] * d_S[1] + R[i, 2] * d_S[2]
            d_along += d[i] * axis[i]
        if 1.0 - d_along**2 > _ALONG**2:
            continue
        p = rays.p_OSset[ray % len(rays.p_OSset)]
        # Products with and without the parts along the axis.
        along = square = toward = across = slant = 0.0
        for i in range(3):
            away[i] = p[i] - p_OC[i]
            along += away[i] * axis[i]
            square += away[i] ** 2
            toward += away[i] * d[i]
        for i in range(3):
            side, turn = away[i] - along * axis[i], d[i] - d_along * axis[i]
            across += side * turn
            slant += turn**2
        nearest = np.inf
        for end in (-half, half):
            b = toward - end * d_along
            c = square - 2.0 * along * end + end**2 - radius**2
            for sign in (-1.0, 1.0):
                distance = -b + sign * np.sqrt(b * b - c)
                # NaN, where there is no root, is neither.
                if 0.0 <= distance < nearest:
                    place = along + distance * d_along
                    if abs(place) >= half and place * end >= 0.0:
                        nearest = distance
        if slant > 0.0:
            c = square - along**2 - radius**2
            for sign in (-1.0, 1.0):
                distance = -across + sign * np.sqrt(across**2 - slant * c)
                distance /= slant
                place = along + distance * d_along
                if 0.0 <= distance < nearest and abs(place) <= half:
                    nearest = distance
        reach = rays.max_ranges[ray % len(rays.max_ranges)]
        if nearest > reach or nearest >= hits.ranges[ray] - _SAME:
            continue
        hits.ranges[ray] = nearest
        hits.owner[ray] = capsules.owners[k]
        hits.group[ray] = capsules.groups[k]
        place = min(max(along + nearest * d_along, -half), half)
        for n in range(hits.normals.shape[1]):
            outward = 0.0
            for i in range(3):
                normal = away[i] + nearest * d[i] - place * axis[i]
                outward += X_OL[i, n] * normal
            hits.normals[ray, n] = outward
