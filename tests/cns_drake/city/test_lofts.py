from helpers.mesh_checks import is_closed, out_of_plane, volume
import numpy as np
import pytest

from cns_drake.city.geometry.lofts import (
    along_x,
    along_y,
    beam,
    lathe,
    loft,
    prism,
    side_prism,
    tube,
)


def polygon_area(sides, radius):
    return 0.5 * sides * radius**2 * np.sin(2 * np.pi / sides)


def frustum_volume(sides, r0, r1, length):
    a, b = polygon_area(sides, r0), polygon_area(sides, r1)
    return length / 3 * (a + b + np.sqrt(a * b))


@pytest.mark.parametrize("sides", [3, 4, 5, 8])
def test_tube_is_a_closed_prism_of_the_right_volume(sides):
    start, end = np.array([1.0, -2.0, 0.5]), np.array([2.0, 0.3, 4.0])
    mesh = tube([start, end], (0.3, 0.3), sides)
    length = np.linalg.norm(end - start)
    assert is_closed(mesh)
    assert volume(mesh) == pytest.approx(polygon_area(sides, 0.3) * length)
    assert out_of_plane(mesh) < 1e-9


@pytest.mark.parametrize(
    "end", [(5.0, 0.0, 0.0), (0.0, 5.0, 0.0), (0.0, 0.0, -5.0)]
)
def test_tube_works_along_each_axis(end):
    mesh = tube([(0, 0, 0), end], (0.2, 0.4), 6)
    assert volume(mesh) == pytest.approx(frustum_volume(6, 0.2, 0.4, 5.0))


def test_bent_tube_keeps_plane_faces_and_cavalieri_volume():
    # All rings are parallel, so that a sideways bend changes no volume.
    mesh = tube(
        [(0, 0, 0), (0.4, 0.1, 1.0), (0.0, 0.0, 3.0)], (0.5, 0.4, 0.2), 8
    )
    expected = frustum_volume(8, 0.5, 0.4, 1.0)
    expected += frustum_volume(8, 0.4, 0.2, 2.0)
    assert is_closed(mesh)
    assert out_of_plane(mesh) < 1e-9
    assert volume(mesh) == pytest.approx(expected)


def test_lathe_volume_and_height():
    mesh = lathe([(0.5, -0.3), (0.5, 1.0), (0.1, 1.5)], 12)
    expected = polygon_area(12, 0.5) * 1.3 + frustum_volume(12, 0.5, 0.1, 0.5)
    assert is_closed(mesh)
    assert volume(mesh) == pytest.approx(expected)
    assert mesh.vertices[:, 2].min() == -0.3
    assert mesh.vertices[:, 2].max() == 1.5


def test_lathe_can_fold_back_into_a_basin():
    mesh = lathe([(2.0, 0.0), (2.0, 1.0), (1.5, 1.0), (1.5, 0.2)], 16)
    expected = polygon_area(16, 2.0) - 0.8 * polygon_area(16, 1.5)
    assert is_closed(mesh)
    assert volume(mesh) == pytest.approx(expected)


def test_prism_and_side_prism_agree():
    outline = [(0.0, 0.0), (2.0, 0.0), (1.5, 1.0), (0.2, 1.2)]
    area = 0.5 * (2.0 * 1.0 + 1.5 * 1.2 - 0.2 * 1.0)
    upright = prism(outline, -1.0, 2.0)
    lying = side_prism(outline, -0.5, 2.5)
    for mesh in (upright, lying):
        assert is_closed(mesh)
        assert volume(mesh) == pytest.approx(3.0 * area)
    assert lying.vertices.min(axis=0) == pytest.approx([0.0, -0.5, 0.0])
    assert lying.vertices.max(axis=0) == pytest.approx([2.0, 2.5, 1.2])


def test_turned_axes_are_rotations():
    mesh = lathe([(0.4, 0.0), (0.1, 2.0)], 5)
    for turned, axis in ((along_x(mesh), 0), (along_y(mesh), 1)):
        assert volume(turned) == pytest.approx(volume(mesh))
        assert turned.vertices[:, axis].max() == 2.0


def test_beam_size_along_and_across():
    mesh = beam((0, 0, 1.0), (4.0, 0, 1.0), width=0.2, depth=0.5)
    assert mesh.vertices.max(axis=0) == pytest.approx([4.0, 0.1, 1.25])
    assert mesh.vertices.min(axis=0) == pytest.approx([0.0, -0.1, 0.75])
    slanted = beam((1, 2, 3), (2, 1, 6), 0.2, 0.1)
    assert is_closed(slanted)
    assert volume(slanted) == pytest.approx(0.02 * np.sqrt(11.0))
    upright = beam((0, 0, 0), (0, 0, 2), 0.3, 0.1)
    assert volume(upright) == pytest.approx(0.06)


def test_twisted_loft_is_split_into_triangles():
    square = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)], dtype=float)
    c, s = np.cos(0.3), np.sin(0.3)
    twisted = square @ np.array([[c, s], [-s, c]])
    mesh = loft(
        [
            np.column_stack([square, np.zeros(4)]),
            np.column_stack([twisted, np.full(4, 2.0)]),
        ]
    )
    assert is_closed(mesh)
    assert sorted(map(len, mesh.faces)) == [3] * 8 + [4] * 2
    assert volume(mesh) > 0
