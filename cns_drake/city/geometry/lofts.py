"""Closed meshes swept along a path: tubes, lofts, solids of revolution."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from cns_drake.city.geometry.mesh import Mesh

# A quadrilateral whose corners leave their common plane by more than this
# [m] is written as two triangles.
_PLANE_TOLERANCE = 5e-4


def loft(sections: ArrayLike) -> Mesh:
    """Returns the closed skin over a row of cross sections.

    Args:
        sections: (S, M, 3) corners of S sections with M corners each [m].
            Seen against the direction of travel (looking from the last
            section back to the first), the corners run counter-clockwise.
            The first and the last section are plane and convex; they
            become the caps.
    """
    sections = np.asarray(sections, dtype=float)
    num_sections, num_corners, _ = sections.shape
    vertices = sections.reshape(-1, 3)
    faces = []
    for s in range(num_sections - 1):
        a, b = s * num_corners, (s + 1) * num_corners
        for k in range(num_corners):
            n = (k + 1) % num_corners
            faces += _plane_faces(vertices, (a + k, a + n, b + n, b + k))
    last = (num_sections - 1) * num_corners
    faces += _cap(list(range(num_corners))[::-1])
    faces += _cap([last + k for k in range(num_corners)])
    return Mesh(vertices, tuple(faces))


def tube(points: ArrayLike, radii: ArrayLike, sides: int) -> Mesh:
    """Returns a closed tube along a gently bent path.

    All rings are parallel (perpendicular to the chord of the path), so
    that every face is plane and the path may not turn by 90 degrees.

    Args:
        points: (S, 3) centres of the rings [m].
        radii: (S,) radius of each ring [m].
        sides: corners of a ring.
    """
    points = np.asarray(points, dtype=float)
    axis = points[-1] - points[0]
    axis = axis / np.linalg.norm(axis)
    helper = (1.0, 0.0, 0.0) if abs(axis[0]) < 0.7 else (0.0, 1.0, 0.0)
    u = np.cross(axis, helper)
    u /= np.linalg.norm(u)
    v = np.cross(axis, u)
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.outer(np.cos(angle), u) + np.outer(np.sin(angle), v)
    return loft(points[:, None] + np.asarray(radii)[:, None, None] * ring)


def lathe(profile: ArrayLike, sides: int) -> Mesh:
    """Returns the closed solid of revolution about z of a profile.

    Args:
        profile: rows (radius, z) from the bottom upwards [m]; all radii
            positive.
        sides: facets around the axis.
    """
    profile = np.asarray(profile, dtype=float)
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    sections = np.empty((len(profile), sides, 3))
    sections[:, :, :2] = profile[:, 0, None, None] * ring
    sections[:, :, 2] = profile[:, 1, None]
    return loft(sections)


def prism(outline: ArrayLike, bottom: float, top: float) -> Mesh:
    """Returns a vertical prism over a convex counter-clockwise outline.

    Args:
        outline: (M, 2) corners [m].
        bottom: z of the lower cap [m].
        top: z of the upper cap [m].
    """
    outline = np.asarray(outline, dtype=float)
    return loft(
        [
            np.column_stack([outline, np.full(len(outline), z)])
            for z in (bottom, top)
        ]
    )


def rectangle(half_x: float, half_y: float, z: float) -> np.ndarray:
    """Returns (4, 3) corners at height z, counter-clockwise from above."""
    x, y = half_x, half_y
    return np.array([(x, y, z), (-x, y, z), (-x, -y, z), (x, -y, z)])


def side_prism(outline: ArrayLike, right: float, left: float) -> Mesh:
    """Returns a prism over a convex outline in the x-z plane.

    Args:
        outline: (M, 2) corners x, z [m], counter-clockwise with x to the
            right and z up.
        right: y of the cap on the right-hand side (seen along +x) [m].
        left: y of the other cap, greater than `right` [m].
    """
    flat = prism(outline, -left, -right)
    x, y, z = flat.vertices.T
    return Mesh(np.column_stack([x, -z, y]), flat.faces)


def along_x(mesh: Mesh) -> Mesh:
    """Returns the mesh with its z axis turned to x (and x to y)."""
    return Mesh(mesh.vertices[:, [2, 0, 1]], mesh.faces)


def along_y(mesh: Mesh) -> Mesh:
    """Returns the mesh with its z axis turned to y (and y to x)."""
    return Mesh(mesh.vertices[:, [1, 2, 0]], mesh.faces)


def beam(start: ArrayLike, end: ArrayLike, width: float, depth: float) -> Mesh:
    """Returns a straight bar of rectangular section between two points.

    Args:
        start: (3,) centre of the first end [m].
        end: (3,) centre of the other end [m].
        width: size across, horizontally [m].
        depth: size across the width and the length [m].
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    axis = (end - start) / np.linalg.norm(end - start)
    helper = (0.0, 0.0, 1.0) if abs(axis[2]) < 0.95 else (0.0, 1.0, 0.0)
    across = np.cross(helper, axis)
    across *= width / 2 / np.linalg.norm(across)
    up = np.cross(axis, across)
    up *= depth / 2 / np.linalg.norm(up)
    ring = np.array([across + up, -across + up, -across - up, across - up])
    return loft([start + ring, end + ring])


def _plane_faces(
    vertices: np.ndarray, quad: tuple[int, int, int, int]
) -> list[tuple[int, ...]]:
    """Returns the quad if it is plane and whole, else its triangles."""
    a, b, c, d = (vertices[i] for i in quad)
    normal = np.cross(c - a, d - b)
    length = np.linalg.norm(normal)
    if length > 0 and abs((b - a) @ normal) / length < _PLANE_TOLERANCE:
        return [quad]
    return [quad[:3], (quad[0], quad[2], quad[3])]


def _cap(ring: list[int]) -> list[tuple[int, ...]]:
    """Returns a convex ring of corners as quads and at most one triangle."""
    return [
        (ring[0], *ring[k : min(k + 3, len(ring))])
        for k in range(1, len(ring) - 1, 2)
    ]
