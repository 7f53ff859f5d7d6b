"""Polygons as meshes, against areas and normals."""

import numpy as np
import pytest
from shapely.affinity import rotate
from shapely.geometry import Point, box

from worlds.shapes import snap, surface_mesh


def ring(yaw_deg: float = 17.0):
    """Returns a disc with a square hole, turned and away from the origin."""
    disc = Point(40, -30).buffer(20).difference(box(36, -33, 44, -28))
    return snap(rotate(disc, yaw_deg, origin=(40, -30)))


def normals(mesh) -> np.ndarray:
    a, b, c = (mesh.vertices[mesh.triangles()[:, k]] for k in range(3))
    return np.cross(b - a, c - a) / 2


@pytest.mark.parametrize("spacing", [0.0, 4.0])
def test_surface_faces_up_and_follows_the_height(spacing):
    def height(x, y):
        return 0.05 * x - 0.02 * y + 1.0

    mesh = surface_mesh(ring(), height, spacing)
    n = normals(mesh)
    assert n[:, 2].min() > 0
    assert n[:, 2].sum() == pytest.approx(ring().area, rel=1e-6)
    # On a plane every face has the plane's normal.
    unit = n / np.linalg.norm(n, axis=1, keepdims=True)
    expected = np.array([-0.05, 0.02, 1.0])
    expected /= np.linalg.norm(expected)
    np.testing.assert_allclose(unit, np.tile(expected, (len(n), 1)), atol=1e-6)
    x, y, z = mesh.vertices.T
    np.testing.assert_allclose(z, height(x, y))


def test_surface_follows_relief_between_the_corners():
    square = box(0, 0, 40, 40)

    def hump(x, y):
        return np.exp(-((x - 20) ** 2 + (y - 20) ** 2) / 50.0)

    assert surface_mesh(square, hump).vertices[:, 2].max() < 1e-6
    assert surface_mesh(square, hump, 4.0).vertices[:, 2].max() > 0.99
