"""The primitives of groups of geometry, as Embree takes them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydrake.math import RigidTransform

from cns_drake.ray_casting import embree
from cns_drake.ray_casting.curved_proxies import (
    circumscribe,
    curved_members,
    num_sides,
)
from cns_drake.ray_casting.ray_groups import Member, RayGroup
from cns_drake.scene import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    HalfSpaceSurface,
    TriangleSurface,
    merge_triangles,
)

# Masks of geometry: the triangles and the curved shapes that rays hit;
# polyhedra around curved shapes; and all.
FLAT = 1
CURVED = 4
SOLID = FLAT | CURVED
PROXY = 2
ALL = SOLID | PROXY
# Owner of the primitives of proxies.
PROXY_OWNER = -2
# Longest cones and rounded segments [radii]: longer ones lose hits to single
# precision (measured at 3000: one in 40), and are cut into pieces.
_SLENDEREST = 700.0
# Greatest number of these pieces.
_MOST_PIECES = 1000


class Primitives(NamedTuple):
    """The data of one Embree geometry.

    Attributes:
        kind: Embree's number for the type of geometry.
        buffers: slot, format and array of each buffer.
        owners: (P,) int32 for each primitive, the number of its member in the
            group.
        mask: `FLAT`, `CURVED`, or `PROXY` for polyhedra around curved shapes.
        surface: the triangles in double precision, if rays hit triangles.
    """

    kind: int
    buffers: list[tuple[int, int, np.ndarray]]
    owners: np.ndarray
    mask: int = CURVED
    surface: TriangleSurface | None = None


def merge_first(group: RayGroup) -> Iterator[Primitives]:
    """Yields the Embree geometries of a group for the first hierarchy.

    Every group adds its triangles. A group that can move also adds its curved
    shapes; any other group adds a polyhedron around each curved shape instead.
    All rays are cast on the first hierarchy.
    """
    members = _numbered_members(group)
    flat = [
        (index, X_LG, surface)
        for index, X_LG, surface in members
        if isinstance(surface, TriangleSurface)
    ]
    if flat:
        yield _triangle_primitives(flat, FLAT)
    if group.frame_id is not None:
        yield from merge_curved(members)
        return
    curved = curved_members(group)
    if curved:
        sides = num_sides(len(curved))
        proxies = [(PROXY_OWNER, X, circumscribe(s, sides)) for X, s in curved]
        yield _triangle_primitives(proxies, PROXY)


def merge_second(group: RayGroup) -> Iterator[Primitives]:
    """Yields the Embree geometries of a group for the second hierarchy.

    A group that cannot move adds its curved shapes; any other group adds
    nothing. A ray is cast on the second hierarchy only if it hits one of the
    polyhedra around curved shapes, or starts in such a polyhedron (see
    `merge_first`).
    """
    if group.frame_id is None:
        yield from merge_curved(_numbered_members(group))


def _numbered_members(group: RayGroup) -> list[Member]:
    """Returns a group's members, numbered from 0 within the group.

    The primitives then depend only on the shapes, so that groups of the same
    shapes can share them.
    """
    return [(k, X, surface) for k, (_, X, surface) in enumerate(group.members)]


def _triangle_primitives(
    surfaces: Sequence[tuple[int, RigidTransform, TriangleSurface]], mask: int
) -> Primitives:
    merged, owners = merge_triangles(surfaces)
    vertices = merged.p_GVset.astype(np.float32)
    corners = merged.triangles.astype(np.uint32)
    buffers = [
        (embree.VERTEX_BUFFER, embree.FLOAT3, vertices),
        (embree.INDEX_BUFFER, embree.UINT3, corners),
    ]
    return Primitives(
        embree.TRIANGLE,
        buffers,
        owners,
        mask,
        merged if mask == FLAT else None,
    )


def merge_curved(members: Sequence[Member]) -> Iterator[Primitives]:
    """Yields one Embree geometry for each kind of curved shape in a group.

    Embree intersects spheres, cones, discs and rounded segments exactly (in
    single precision).

    Args:
        members: index, pose X_LG in the group's frame L, and surface of each
            geometry G of the group.
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
        segments += [(index, piece) for piece in _cut_shape(ends, surface)]
        if is_cone:
            # Embree closes cones as well, but rounding of the axis tilts the
            # ends of flat cones; discs do not tilt.
            discs.append((index, ends, [-axis, axis]))

    for kind, segments in (
        (embree.CONE, cones),
        (embree.ROUND_SEGMENT, capsules),
    ):
        first_ends = 2 * np.arange(len(segments), dtype=np.uint32)
        if segments:
            ends_of = embree.INDEX_BUFFER, embree.UINT, first_ends
            yield Primitives(
                kind,
                [_vertex_buffer(segments), ends_of],
                _owner_numbers(segments),
            )
    if discs:
        normals = _float32(d[2] for d in discs)
        facing = embree.NORMAL_BUFFER, embree.FLOAT3, normals
        owners = np.repeat(_owner_numbers(discs), 2)
        yield Primitives(embree.DISC, [_vertex_buffer(discs), facing], owners)
    if spheres:
        yield Primitives(
            embree.SPHERE, [_vertex_buffer(spheres)], _owner_numbers(spheres)
        )


def _owner_numbers(shapes: Iterable[tuple]) -> np.ndarray:
    return np.array([owner for owner, *_ in shapes], np.int32)


def _cut_shape(
    ends: Sequence[ArrayLike], surface: CylinderSurface | CapsuleSurface
) -> list[np.ndarray]:
    """Cuts a long shape; returns the ends (2, 4) of each piece.

    Each end is a centre and a radius. Rays that start inside the shape hit the
    joints.
    """
    slenderness = surface.length / surface.radius
    num = math.ceil(min(slenderness / _SLENDEREST, _MOST_PIECES))
    first, last = (np.asarray(end) for end in ends)
    joints = np.linspace(first, last, max(num, 1) + 1)
    return [joints[k : k + 2] for k in range(len(joints) - 1)]


def _vertex_buffer(shapes: Iterable[tuple]) -> tuple[int, int, np.ndarray]:
    places = _float32(shape[1] for shape in shapes)
    return embree.VERTEX_BUFFER, embree.FLOAT4, places


def _float32(arrays: Iterable[ArrayLike]) -> np.ndarray:
    return np.concatenate([np.asarray(a) for a in arrays]).astype(np.float32)
