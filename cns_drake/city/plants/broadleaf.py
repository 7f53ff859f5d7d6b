"""Growth of broad-leaved trees: trunk, limbs, and clumps of leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cns_drake.city.geometry.lofts import tube
from cns_drake.city.geometry.mesh import Mesh, merge_meshes
from cns_drake.city.plants.foliage import keep_above, tufts

_ROOT = -0.5
_FORK_SIDES = 4


@dataclass(frozen=True)
class BroadleafForm:
    """The shape of a broad-leaved tree at its nominal size.

    Attributes:
        height: of the top of the crown [m].
        crown_base: of the lowest leaf [m].
        crown_radius: greatest radius of the crown [m].
        profile: relative crown radius at equal steps from the base of the
            crown to its top.
        trunk_radius: at breast height [m].
        limbs: number of main branches.
        clumps: number of leaf clumps that the crown is made of.
        clump_radius: half the size of a clump [m].
        tufts_per_clump: number of leaf tufts in a clump.
        leaves_per_tuft: number of leaves in a tuft.
        leaf_length: mean length of a leaf spray [m].
        leaf_width: mean width of a leaf spray [m].
        raggedness: relative depth of the lobes of the crown's outline.
        lean: sideways wander of the trunk [m].
    """

    height: float
    crown_base: float
    crown_radius: float
    profile: tuple[float, ...]
    trunk_radius: float
    limbs: int
    clumps: int
    clump_radius: float
    tufts_per_clump: int = 4
    leaves_per_tuft: int = 4
    leaf_length: float = 0.55
    leaf_width: float = 0.38
    raggedness: float = 0.22
    lean: float = 0.25


def grow_broadleaf(
    rng: np.random.Generator, form: BroadleafForm
) -> tuple[Mesh, Mesh]:
    """Returns the wood and the leaves of one tree, z = 0 at the ground."""
    stem = _stem_axis(rng, form)
    centers = _clump_centers(rng, form, stem)
    wood = _wood(rng, form, stem, centers)
    foliage = _foliage(rng, form, stem, centers)
    return wood, keep_above(foliage, form.crown_base)


def _stem_axis(rng: np.random.Generator, form: BroadleafForm) -> np.ndarray:
    """Returns a smooth upright axis, (K, 3), root to tip."""
    z = np.array([_ROOT, 0.0, 0.12, 0.3, 0.5, 0.7, 0.86])
    z[2:] *= form.height
    t = np.clip(z / form.height, 0, 1)
    axis = np.zeros((len(z), 3))
    axis[:, 2] = z
    for k in range(2):
        bend, wave, phase = rng.uniform(-1, 1, 3)
        axis[:, k] = form.lean * (
            bend * t**1.5 + 0.5 * wave * np.sin(5 * t + 3 * phase) * t
        )
    return axis


def _at_height(stem: np.ndarray, z: float | np.ndarray) -> np.ndarray:
    """Returns the points of the stem at the given heights, (..., 3)."""
    return np.stack(
        [np.interp(z, stem[:, 2], stem[:, k]) for k in range(2)]
        + [np.minimum(z, stem[-1, 2])],
        axis=-1,
    )


def _clump_centers(
    rng: np.random.Generator, form: BroadleafForm, stem: np.ndarray
) -> np.ndarray:
    """Returns (N, 3) clump centres, spaced out, most near the outside."""
    depth = form.height - form.crown_base
    waves = rng.uniform(0, 2 * np.pi, (3, 2))
    limit = 0.8 * form.clump_radius
    spacing = 1.25 * form.clump_radius
    chosen: list[np.ndarray] = []
    while len(chosen) < form.clumps:
        t, turn, share = rng.uniform(0, 1, 3)
        theta = 2 * np.pi * turn
        lobes = sum(
            np.sin((k + 1) * theta + phase + turn_z * t) / (k + 1)
            for k, (phase, turn_z) in enumerate(waves)
        )
        outline = np.interp(
            t, np.linspace(0, 1, len(form.profile)), form.profile
        )
        radius = form.crown_radius * outline
        radius *= 1 + form.raggedness * lobes
        reach = max(radius - limit, 0.0) * np.sqrt(0.08 + 0.92 * share)
        z = form.crown_base + limit * 0.6 + t * (depth - 1.5 * limit)
        point = _at_height(stem, z)
        point = np.array(
            [
                point[0] + reach * np.cos(theta),
                point[1] + reach * np.sin(theta),
                z,
            ]
        )
        if all(np.linalg.norm(point - c) > spacing for c in chosen):
            chosen.append(point)
            spacing = 1.25 * form.clump_radius
        else:
            # Give way a little after each failure, so that the search ends.
            spacing *= 0.995
    return np.array(chosen)


def _wood(
    rng: np.random.Generator,
    form: BroadleafForm,
    stem: np.ndarray,
    centers: np.ndarray,
) -> Mesh:
    r = form.trunk_radius
    radii = r * np.array([1.45, 1.35, 1.0, 0.85, 0.6, 0.35, 0.1])
    pieces = [tube(stem, radii, 8)]
    limb_points = []
    for target in centers[_spread_out(centers, form.limbs)]:
        rise = target[2] - form.crown_base
        fork = form.crown_base * rng.uniform(0.75, 1.0) + 0.45 * rise
        start = _at_height(stem, fork)
        middle = 0.5 * (start + target)
        middle[2] += rng.uniform(0.0, 0.25) * np.linalg.norm(
            target[:2] - start[:2]
        )
        thick = r * np.interp(fork / form.height, [0.2, 0.9], [0.55, 0.15])
        limb = np.array([start, middle, target])
        pieces.append(
            tube(limb, thick * np.array([1.0, 0.7, 0.25]), _FORK_SIDES)
        )
        limb_points += [middle, 0.4 * middle + 0.6 * target]
    joints = np.array(limb_points)
    for center in centers:
        near = joints[np.argmin(np.linalg.norm(joints - center, axis=1))]
        if np.linalg.norm(center - near) > 0.3:
            pieces.append(tube([near, center], [0.14 * r, 0.05 * r], 3))
    return merge_meshes(*pieces)


def _spread_out(points: np.ndarray, count: int) -> list[int]:
    """Returns indices of points that lie far from each other."""
    chosen = [0]
    distance = np.linalg.norm(points - points[0], axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(np.argmax(distance)))
        step = np.linalg.norm(points - points[chosen[-1]], axis=1)
        distance = np.minimum(distance, step)
    return chosen


def _foliage(
    rng: np.random.Generator,
    form: BroadleafForm,
    stem: np.ndarray,
    centers: np.ndarray,
) -> Mesh:
    per = form.tufts_per_clump
    offset = rng.standard_normal((len(centers) * per, 3))
    offset /= np.linalg.norm(offset, axis=1, keepdims=True)
    offset *= form.clump_radius * rng.uniform(0.2, 0.8, (len(offset), 1))
    points = np.repeat(centers, per, axis=0) + offset
    inner = _at_height(stem, points[:, 2] - 0.3 * form.crown_radius)
    # Leaves look away from the stem, from their clump, and a little up.
    away = points - inner
    away /= np.linalg.norm(away, axis=1, keepdims=True) + 1e-9
    outward = offset / form.clump_radius + 0.7 * away + (0.0, 0.0, 0.15)
    return tufts(
        rng,
        points,
        outward,
        form.leaves_per_tuft,
        form.leaf_length,
        form.leaf_width,
    )
