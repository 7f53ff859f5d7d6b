"""Surfaces as buffers of Embree's primitives."""

from collections.abc import Iterable, Iterator, Sequence
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydrake.math import RigidTransform

from cns_drake.ray_casting import embree
from cns_drake.ray_casting.curved_shapes import circumscribe
from cns_drake.ray_casting.ray_groups import Member, RayGroup
from cns_drake.scene.surfaces import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    HalfSpaceSurface,
    TriangleSurface,
    merge_triangles,
)

# Masks of geometry: all rays hit solids, some also hit proxies.
SOLID, PROXY = 1, 2
ALL = SOLID | PROXY
# Owns the primitives of proxies.
PROXY_OWNER = -2
# Longest cones and rounded segments [radii]: longer ones lose hits to single
# precision (measured at 3000: one in 40). They are cut, into at most the second
# number of pieces.
_SLENDEREST = 700.0
_MOST_PIECES = 1000


class Primitives(NamedTuple):
    """One Embree geometry, of a kind that Embree numbers.

    Buffers are (slot, format, array) each. `owners` has the (P,) int32 number
    of each primitive's member in its group, and `mask` is `SOLID` or `PROXY`.
    """

    kind: int
    buffers: list[tuple[int, int, np.ndarray]]
    owners: np.ndarray
    mask: int = SOLID


def merge_first(group: RayGroup) -> Iterator[Primitives]:
    """Yields the primitives of a group on which all rays are cast.

    They are its triangles, and polyhedra about its curved shapes; or the curved
    shapes themselves, if the group can move.
    """
    members = _numbered(group)
    flat = [
        (index, X_LG, surface)
        for index, X_LG, surface in members
        if isinstance(surface, TriangleSurface)
    ]
    if flat:
        yield _as_primitives(flat, SOLID)
    if group.frame_id is not None:
        yield from merge_curved(members)
        return
    curved = [
        (PROXY_OWNER, X_LG, circumscribe(surface))
        for _, X_LG, surface in members
        if not isinstance(surface, TriangleSurface | HalfSpaceSurface)
    ]
    if curved:
        yield _as_primitives(curved, PROXY)


def merge_second(group: RayGroup) -> Iterator[Primitives]:
    """Yields the primitives for few rays: curved shapes that cannot move."""
    if group.frame_id is None:
        yield from merge_curved(_numbered(group))


def _numbered(group: RayGroup) -> list[Member]:
    """Returns the members of a group with their numbers in it.

    Primitives then depend on shapes alone, and groups of the same shapes share
    them.
    """
    return [(k, X, surface) for k, (_, X, surface) in enumerate(group.members)]


def _as_primitives(
    surfaces: Sequence[tuple[int, RigidTransform, TriangleSurface]], mask: int
) -> Primitives:
    merged, owners = merge_triangles(surfaces)
    vertices = merged.p_GVset.astype(np.float32)
    corners = merged.triangles.astype(np.uint32)
    buffers = [
        (embree.VERTEX_BUFFER, embree.FLOAT3, vertices),
        (embree.INDEX_BUFFER, embree.UINT3, corners),
    ]
    return Primitives(embree.TRIANGLE, buffers, owners, mask)


def merge_curved(members: Sequence[Member]) -> Iterator[Primitives]:
    """Yields one geometry for each kind of curved primitive.

    Embree intersects spheres, cones, discs and rounded segments exactly (in
    single precision).
    """
    cones: list[tuple[int, ArrayLike]] = []
    capsules: list[tuple[int, ArrayLike]] = []
    spheres: list[tuple[int, ArrayLike]] = []
    discs: list[tuple[int, ArrayLike, ArrayLike]] = []
    for index, X_LG, surface in members:
        if isinstance(surface, TriangleSurface | HalfSpaceSurface):
            continue
        if isinstance(surface, EllipsoidSurface):
            radius = surface.semi_axes[0]
            spheres.append((index, [[*X_LG.translation(), radius]]))
            continue
        axis = X_LG.rotation().matrix()[:, 2]
        ends = [
            [*(X_LG.translation() + side * axis), surface.radius]
            for side in (-surface.length / 2.0, surface.length / 2.0)
        ]
        is_cone = isinstance(surface, CylinderSurface)
        segments = cones if is_cone else capsules
        segments += [(index, piece) for piece in _cut(ends, surface)]
        if is_cone:
            # Embree closes cones as well, but rounding of the axis tilts the
            # ends of flat ones; discs do not tilt.
            discs.append((index, ends, [-axis, axis]))

    for kind, segments in (
        (embree.CONE, cones),
        (embree.ROUND_SEGMENT, capsules),
    ):
        first_ends = 2 * np.arange(len(segments), dtype=np.uint32)
        if segments:
            ends_of = embree.INDEX_BUFFER, embree.UINT, first_ends
            yield Primitives(
                kind, [_vertices(segments), ends_of], _owners(segments)
            )
    if discs:
        normals = _float32(d[2] for d in discs)
        facing = embree.NORMAL_BUFFER, embree.FLOAT3, normals
        owners = np.repeat(_owners(discs), 2)
        yield Primitives(embree.DISC, [_vertices(discs), facing], owners)
    if spheres:
        yield Primitives(embree.SPHERE, [_vertices(spheres)], _owners(spheres))


def _owners(shapes: Iterable[tuple]) -> np.ndarray:
    return np.array([owner for owner, *_ in shapes], np.int32)


def _cut(
    ends: Sequence[ArrayLike], surface: CylinderSurface | CapsuleSurface
) -> list[np.ndarray]:
    """Returns the (2, 4) ends of pieces within the allowed slenderness.

    Rays from inside meet the joints.
    """
    slenderness = surface.length / surface.radius
    num = math.ceil(min(slenderness / _SLENDEREST, _MOST_PIECES))
    first, last = (np.asarray(end) for end in ends)
    joints = np.linspace(first, last, max(num, 1) + 1)
    return [joints[k : k + 2] for k in range(len(joints) - 1)]


def _vertices(shapes: Iterable[tuple]) -> tuple[int, int, np.ndarray]:
    places = _float32(shape[1] for shape in shapes)
    return embree.VERTEX_BUFFER, embree.FLOAT4, places


def _float32(arrays: Iterable[ArrayLike]) -> np.ndarray:
    return np.concatenate([np.asarray(a) for a in arrays]).astype(np.float32)
