import math

from helpers.mesh_checks import is_closed, volume
from helpers.winding import winding_numbers
import numpy as np
import pytest
from shapely.geometry import Polygon

from cns_drake.city.facades import (
    outlines,
    solids,
)
from cns_drake.city.geometry.mesh import merge_meshes

_C = math.cos(0.7)
_S = math.sin(0.7)
# A rectangle of 14 m by 9 m, turned by 0.7 rad.
TURNED = outlines.rectangle(1, 2, 15, 11) @ np.array([[_C, _S], [-_S, _C]])
COURT = outlines.u_shape(0, 0, 30, 20, 7, 8)


def area(points) -> float:
    return Polygon(points).area


def corners(mesh):
    return mesh.vertices[mesh.triangles()]


def assert_closed(mesh, margin=0.4):
    """Checks that each random point is clearly inside or clearly outside."""
    rng = np.random.default_rng(0)
    low = mesh.vertices.min(axis=0) - margin
    high = mesh.vertices.max(axis=0) + margin
    found = winding_numbers(corners(mesh), rng.uniform(low, high, (300, 3)))
    np.testing.assert_allclose(found, np.round(found), atol=1e-6)
    assert found.min() > -0.5


@pytest.mark.parametrize("points", [TURNED, COURT], ids=["turned", "court"])
def test_prisms_are_closed_and_hold_their_volume(points):
    mesh = solids.prism(points, -0.5, 3.0, bottom=True)
    assert is_closed(merge(mesh))
    assert volume(mesh) == pytest.approx(3.5 * area(points))


def merge(mesh):
    """The mesh with coinciding vertices joined."""
    keys, inverse = np.unique(
        np.round(mesh.vertices, 6), axis=0, return_inverse=True
    )
    inverse = inverse.reshape(-1)
    faces = tuple(tuple(int(inverse[i]) for i in f) for f in mesh.faces)
    return type(mesh)(keys, faces)


def test_frustum_spire_and_sloped_prism_have_their_volumes():
    square = outlines.rectangle(0, 0, 6, 6)
    small = outlines.rectangle(2, 2, 4, 4)
    floor = solids.flat(square, 0.0, up=False)
    frustum = merge_meshes(solids.frustum(square, small, 0.0, 3.0), floor)
    assert volume(frustum) == pytest.approx(3.0 / 3 * (36 + 12 + 4))
    spire = merge_meshes(solids.spire(square, (3, 3), 0.0, 5.0), floor)
    assert volume(spire) == pytest.approx(5.0 / 3 * 36)
    wedge = merge_meshes(solids.sloped_prism(square, 0.0, 4.0, 0.25), floor)
    assert volume(wedge) == pytest.approx(36 * (1.0 + 4.0) / 2)
    for mesh in (frustum, spire, wedge):
        assert is_closed(merge(mesh))


def test_roof_pan_hollows_the_top_out():
    walls = solids.skirt(TURNED, TURNED, 0.0, 5.0)
    floor = solids.flat(TURNED, 0.0, up=False)
    pan = solids.roof_pan(TURNED, 4.0, 5.0, 0.3)
    mesh = merge_meshes(walls, floor, pan)
    inner = area(TURNED) - 2 * 0.3 * (14 + 9) + 4 * 0.09
    assert volume(mesh) == pytest.approx(5.0 * area(TURNED) - inner)
    assert is_closed(merge(mesh))


def test_revolved_profile_has_the_volume_of_its_polygons():
    profile = [(2.0, 0.0), (3.0, 1.5), (3.0, 4.0), (0.0, 6.0)]
    mesh = solids.revolved(profile, 12, (5.0, -3.0))
    floor = outlines.regular_polygon(2.0, 12, (5.0, -3.0))
    mesh = merge_meshes(mesh, solids.flat(floor, 0.0, up=False))
    unit = 0.5 * 12 * math.sin(2 * math.pi / 12)
    expected = unit * (1.5 / 3 * (4 + 6 + 9) + 2.5 * 9 + 2.0 / 3 * 9)
    assert volume(mesh) == pytest.approx(expected)
    assert is_closed(merge(mesh))


@pytest.mark.parametrize(
    ("profile", "section"),
    [
        ([(0, 0), (4, 3), (8, 0)], 12.0),
        ([(0, 0), (0, 2), (4, 0), (4, 2), (8, 0)], 8.0),
        ([(0, 0), (2, 2), (6, 2), (8, 0)], 12.0),
    ],
)
def test_sheds_hold_their_section(profile, section):
    mesh = solids.extruded(profile, -3.0, 7.0)
    base = outlines.rectangle(-3.0, 0.0, 7.0, 8.0)
    mesh = merge_meshes(mesh, solids.flat(base, 0.0, up=False))
    assert volume(mesh) == pytest.approx(10.0 * section)
    assert_closed(mesh)


def test_clockwise_outline_is_refused():
    with pytest.raises(ValueError, match="clockwise"):
        solids.flat(TURNED[::-1], 0.0)
