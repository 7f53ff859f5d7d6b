"""Polyhedra that approximate round shapes."""

import numpy as np

from evaluation.base.elementary import cos, sin


def revolved(
    radius: np.ndarray, z: np.ndarray, sides: int
) -> tuple[np.ndarray, np.ndarray]:
    """Returns a convex polyhedron that approximates a solid of revolution.

    The polyhedron is the convex hull of regular polygons around the z axis, and
    of the polygons mirrored at z = 0.

    Args:
        radius: (N,) circumradii of the polygons [m].
        z: (N,) heights of the polygons, z >= 0 [m].
        sides: number of sides of each polygon.

    Returns:
        (V, 3) vertices [m]; (M, 3) int32 triangles, counter-clockwise seen from
        outside.
    """
    # Slow to import, and most scenes have no round shapes.
    from scipy.spatial import ConvexHull

    angle = 2.0 * np.pi * np.arange(sides)[:, None] / sides
    xyz = radius * cos(angle), radius * sin(angle), z
    upper = np.stack(np.broadcast_arrays(*xyz), axis=-1).reshape(-1, 3)
    vertices = np.unique(np.concatenate([upper, upper * (1, 1, -1)]), axis=0)
    hull = ConvexHull(vertices)
    triangles = hull.simplices.astype(np.int32)
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    outward = np.cross(b - a, c - a) * hull.equations[:, :3]
    is_inside_out = outward.sum(axis=1) < 0.0
    triangles[is_inside_out] = triangles[is_inside_out, ::-1]
    return vertices, triangles
