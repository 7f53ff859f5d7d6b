"""The triangles that Embree gets: each shape's, or a little more.

Embree works in single precision, and its instructions depend on the processor.
It only proposes what a ray may meet: it gets triangles that contain a margin
around each shape, and what a ray meets follows in double precision from the
shape itself (see `packets`).
"""

from collections.abc import Sequence
from functools import lru_cache
import math
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform

from cns_drake.ray_casting.ray_groups import Member
from cns_drake.scene import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    HalfSpaceSurface,
    TriangleSurface,
    merge_triangles,
    tessellate,
)

CurvedSurface = EllipsoidSurface | CylinderSurface | CapsuleSurface

# Margin around a triangle, in its plane [m]: several times the errors of single
# precision. And its least share of the radius of the incircle, because a ray
# that nearly runs in the plane of a large triangle sees little of the margin.
_MARGIN = 2.0**-11
_LEAST_SHARE = 2.0**-9
# A triangle whose corners would move farther than this is widened to a
# rectangle instead [m].
_FARTHEST = 0.25
# Triangles that are widened at once, so that they stay in the cache.
_BLOCK = 2**14
# Sides of the polyhedra around curved shapes. Those of a world with more shapes
# have few sides: they take a quarter of the memory, and more rays meet them in
# vain.
_SIDES = 16
_FEW_SIDES = 8
_MANY_SHAPES = 2000
# Between a curved shape and its polyhedron: a share of the shape's radius, and
# a length in addition [m].
_RATIO = 1.005
_GAP = 1e-3
# No point of a polyhedron is farther than this from the axis or centre of its
# shape: a multiple of the shape's radius, by the number of sides, and a length
# in addition [m].
_BOUND_RATIOS = {_SIDES: 1.1, _FEW_SIDES: 1.2}
_BOUND_GAP = 2.0 * _GAP
# Numbers of a curved shape: X_GL (3, 4), in units of the semi-axes for an
# ellipsoid; half the length of its axis; its radius; 1 for a cylinder, 0 for a
# capsule or an ellipsoid; greatest distance of the polyhedron from the axis.
SHAPE_NUMBERS = 16
# Bytes of a record; see `Proxies`.
_RECORD = np.dtype(
    [("owner", np.int32), ("shape", np.int32), ("corners", float, (3, 3))]
)
RECORD = _RECORD.itemsize


class Proxies(NamedTuple):
    """The triangles of a group for Embree, and the shapes that they stand for.

    All are expressed in the group's frame L.

    Attributes:
        corners: (C, 3) float32 vertices for Embree [m].
        indices: (P, 3) uint32 vertices of each of its triangles.
        records: (P,) what each stands for: `owner`, the number of the member
            of the group; `shape`, the number of a curved shape, -1 for a
            triangle; `corners`, those of the triangle in float64 [m].
        shapes: (S, SHAPE_NUMBERS) float64 the curved shapes.
    """

    corners: np.ndarray
    indices: np.ndarray
    records: np.ndarray
    shapes: np.ndarray


def make_proxies(members: Sequence[Member]) -> Proxies:
    """Returns the proxies of a group's members, none of them half spaces."""
    # Numbered within the group: groups of the same shapes can share them.
    flat: list[tuple[int, RigidTransform, TriangleSurface]] = []
    curved: list[tuple[int, RigidTransform, CurvedSurface]] = []
    for k, (_, X_LG, surface) in enumerate(members):
        if isinstance(surface, TriangleSurface):
            flat.append((k, X_LG, surface))
        elif not isinstance(surface, HalfSpaceSurface):
            curved.append((k, X_LG, surface))
    merged, owners = merge_triangles(flat)
    sides = _SIDES if len(curved) <= _MANY_SHAPES else _FEW_SIDES
    hulls, numbers = merge_triangles(
        [(k, m[1], circumscribe(m[2], sides)) for k, m in enumerate(curved)]
    )
    # Memory takes longer than arithmetic, and what is not used is not taken.
    most = 2 * len(merged.triangles) + len(numbers)
    records = np.empty(most, _RECORD)
    corners = np.empty((3 * most, 3), np.float32)
    end = 0
    for begin in range(0, len(merged.triangles), _BLOCK):
        exact = merged.p_GVset[merged.triangles[begin : begin + _BLOCK]]
        wide, rows = _widen(exact)
        first, end = end, end + len(rows)
        corners[3 * first : 3 * end] = wide.reshape(-1, 3)
        block = records[first:end]
        block["owner"] = owners[begin : begin + _BLOCK][rows]
        block["shape"] = -1
        block["corners"] = exact[rows]
    first, end = end, end + len(numbers)
    block = records[first:end]
    block["owner"] = np.array([m[0] for m in curved], np.int32)[numbers]
    block["shape"] = numbers
    block["corners"] = 0.0
    num_corners = 3 * first + len(hulls.p_GVset)
    corners[3 * first : num_corners] = hulls.p_GVset
    return Proxies(
        corners[:num_corners],
        np.concatenate(
            [
                np.arange(3 * first, dtype=np.uint32).reshape(-1, 3),
                (hulls.triangles + 3 * first).astype(np.uint32),
            ]
        ),
        records[:end],
        np.array(
            [_shape_numbers(X, surface, sides) for _, X, surface in curved]
        ).reshape(-1, SHAPE_NUMBERS),
    )


def _widen(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns triangles that contain a margin around others.

    Args:
        corners: (N, 3, 3) corners of triangles [m].

    Returns:
        (P, 3, 3) float32 corners of P triangles [m]; and (P,) the row of
        `corners` that each contains, in rising order.
    """
    a, b, c = (corners[:, k] for k in range(3))
    opposite = [_length(c - b), _length(a - c), _length(b - a)]
    around = opposite[0] + opposite[1] + opposite[2]
    with np.errstate(divide="ignore", invalid="ignore"):
        middle = (
            opposite[0][:, None] * a
            + opposite[1][:, None] * b
            + opposite[2][:, None] * c
        ) / around[:, None]
        # Radius of the incircle, about which the triangle grows.
        radius = _length(_cross(b - a, c - a)) / around
        growth = np.maximum(_MARGIN / radius, _LEAST_SHARE)
        reach = growth * np.maximum.reduce(opposite)
        wide = corners + growth[:, None, None] * (corners - middle[:, None])
    # No ray meets a triangle without area.
    is_flat = ~(radius > 0.0)
    wide[is_flat] = corners[is_flat]
    wide = wide.astype(np.float32)
    slender = np.flatnonzero(~is_flat & (reach > _FARTHEST))
    wide[slender], second = _rectangles(corners[slender])
    rows = np.concatenate([np.arange(len(wide)), slender])
    # The first of two shapes is hit where both are equally far.
    order = np.argsort(rows, kind="stable")
    wide = np.concatenate([wide, second.astype(np.float32)])
    return wide[order], rows[order]


def _rectangles(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns both halves, (N, 3, 3), of rectangles around triangles."""
    edges = np.roll(corners, -1, axis=1) - corners
    rows = np.arange(len(corners))
    longest = (edges**2).sum(axis=2).argmax(axis=1)
    start, edge = corners[rows, longest], edges[rows, longest]
    tip = corners[rows, longest - 1] - start
    length = _length(edge)[:, None]
    along = edge / length
    across = tip - (tip * along).sum(axis=1)[:, None] * along
    height = _length(across)[:, None]
    across = across / height
    low, left = start - _MARGIN * across, -_MARGIN * along
    right = (length + _MARGIN) * along
    up = (height + 2.0 * _MARGIN) * across
    one = np.stack([low + left, low + right, low + right + up], axis=1)
    other = np.stack([low + left, low + right + up, low + left + up], axis=1)
    return one, other


def _length(vectors: np.ndarray) -> np.ndarray:
    # A sum over an axis of three takes four times as long.
    x, y, z = vectors.T
    return np.sqrt(x * x + y * y + z * z)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    # NumPy's own takes three times as long.
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack(
        [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1
    )


@lru_cache(maxsize=1000)
def circumscribe(
    surface: CurvedSurface, sides: int = _SIDES
) -> TriangleSurface:
    """Returns a polyhedron that contains a curved shape with a gap.

    No point of the polyhedron is farther from the shape's axis or centre than
    `_BOUND_RATIOS[sides]` radii + `_BOUND_GAP`.
    """
    # The faces of an inscribed ball are nearest to its centre at the equator.
    scale = _RATIO / math.cos(np.pi / sides) ** 2
    if isinstance(surface, EllipsoidSurface):
        a, b, c = (scale * axis + _GAP for axis in surface.semi_axes)
        return tessellate(EllipsoidSurface((a, b, c)), sides)
    radius = scale * surface.radius + _GAP
    if isinstance(surface, CapsuleSurface):
        return tessellate(CapsuleSurface(radius, surface.length), sides)
    length = surface.length + 2.0 * _GAP
    return tessellate(CylinderSurface(radius, length), sides)


def _shape_numbers(
    X_LG: RigidTransform, surface: CurvedSurface, sides: int
) -> np.ndarray:
    """Returns the (SHAPE_NUMBERS,) numbers of a curved shape."""
    X_GL = X_LG.inverse().GetAsMatrix34()
    bound = _BOUND_GAP
    if isinstance(surface, EllipsoidSurface):
        X_GL = X_GL / np.reshape(surface.semi_axes, (3, 1))
        bound /= min(surface.semi_axes)
        half, radius = 0.0, 1.0
    else:
        half, radius = surface.length / 2.0, surface.radius
    bound += _BOUND_RATIOS[sides] * radius
    is_cylinder = isinstance(surface, CylinderSurface)
    return np.array([*X_GL.flat, half, radius, is_cylinder, bound])
