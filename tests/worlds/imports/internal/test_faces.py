"""Faces against known areas and normals."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from worlds.imports.faces import face_triangles
from worlds.imports.faults import ImportFaults

# An L with a square hole, counter-clockwise; 12 - 1 = 11 m^2.
OUTER = [(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)]
HOLE = [(0.5, 0.5), (0.5, 1.5), (1.5, 1.5), (1.5, 0.5)]


def ring(xy, X=None):
    points = np.column_stack([np.array(xy, float), np.zeros(len(xy))])
    return points if X is None else points @ X.T


def areas(triangles):
    a, b, c = np.moveaxis(triangles, 1, 0)
    return 0.5 * np.cross(b - a, c - a)


@pytest.mark.parametrize("seed", range(12))
def test_a_face_with_a_hole_however_it_lies(seed):
    R = Rotation.random(random_state=seed).as_matrix()
    faults = ImportFaults()
    rings = [ring(OUTER, R) + seed, ring(HOLE, R) + seed]
    triangles = face_triangles(rings, "one", faults)
    vectors = areas(triangles)
    normal = R[:, 2]
    # Each triangle has the direction of the outer ring; none overlap.
    assert (vectors @ normal > 0).all()
    assert (vectors @ normal).sum() == pytest.approx(11.0, abs=5e-3)
    corners = np.concatenate(rings)
    away = np.linalg.norm(triangles.reshape(-1, 1, 3) - corners, axis=2)
    assert away.min(axis=1).max() < 1e-12
    assert faults.rows() == []


def test_an_arrowhead_is_not_filled_across_its_notch():
    dart = ring([(0, 0), (4, 0), (1, 1), (0, 4)])
    triangles = face_triangles([dart], "one", ImportFaults())
    vectors = areas(triangles)
    assert (vectors[:, 2] > 0).all()
    assert vectors[:, 2].sum() == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("xy", "kind", "area"),
    [
        ([(0, 0), (2, 2), (2, 0), (0, 2)], "crosses itself, repaired", 2.0),
        ([(0, 0), (1, 0), (2, 0)], "without area", 0.0),
        ([(0, 0), (1, 0)], "without area", 0.0),
        ([], "without area", 0.0),
        ([(0, 0), (0, 0), (3, 0), (3, 1), (0, 0)], "repeated corner", 1.5),
        ([(0, 0), (3, 0), (0, 1), (3, 2)] * 300, "very often, left out", 0.0),
    ],
)
def test_faults_are_repaired_or_left_out_and_noted(xy, kind, area):
    faults = ImportFaults()
    points = ring(xy) if xy else np.zeros((0, 3))
    found = areas(face_triangles([points], "the one", faults))
    assert np.abs(found[:, 2]).sum() == pytest.approx(area)
    assert any(
        kind in told and example == "the one"
        for told, _, example in faults.rows()
    )


def test_holes_that_lie_in_each_other_are_a_tangle():
    faults = ImportFaults()
    found = face_triangles([ring(OUTER), *[ring(HOLE)] * 1500], "a", faults)
    assert len(found) == 0
    assert "very often, left out" in faults.rows()[0][0]
