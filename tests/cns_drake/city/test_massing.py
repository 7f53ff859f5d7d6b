import math

from helpers.mesh_checks import is_closed, volume
from helpers.winding import winding_numbers
import numpy as np
import pytest
from shapely.geometry import Point, Polygon, box

from cns_drake.city.facades import details, massing
from cns_drake.city.geometry.mesh import merge_meshes

_C = math.cos(0.7)
_S = math.sin(0.7)
# A rectangle of 14 m by 9 m, turned by 0.7 rad.
TURNED = massing.rectangle(1, 2, 15, 11) @ np.array([[_C, _S], [-_S, _C]])
COURT = massing.u_shape(0, 0, 30, 20, 7, 8)


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


@pytest.mark.parametrize("distance", [0.8, -0.8])
@pytest.mark.parametrize("points", [TURNED, COURT], ids=["turned", "court"])
def test_inset_is_a_mitred_buffer(points, distance):
    moved = Polygon(massing.inset(points, distance))
    oracle = Polygon(points).buffer(-distance, join_style="mitre")
    assert moved.symmetric_difference(oracle).area < 1e-9


def test_inset_moves_each_edge_by_its_own_distance():
    moved = massing.inset(massing.rectangle(0, 0, 10, 6), (1, 2, 3, 4))
    np.testing.assert_allclose(moved, massing.rectangle(4, 1, 8, 3))


def test_inset_limit_leaves_every_edge_a_length():
    ring = massing.rounded(massing.rectangle(0, 0, 30, 20), {0: 5.0}, 2.0)
    limit = massing.inset_limit(ring)
    assert Polygon(massing.inset(ring, limit)).is_valid
    # The chords of the arc vanish near its centre, at 0.7 of the radius: the
    # outer half chords belong to no corner.
    assert 0.6 * 5.0 < limit < 0.8 * 5.0


@pytest.mark.parametrize("corner", range(4))
def test_rounded_corner_follows_its_circle_and_keeps_the_front(corner):
    points = massing.rectangle(0, 0, 20, 12)
    ring = massing.rounded(points, {corner: 4.0}, 1.0)
    rectangle = box(0, 0, 20, 12)
    center = np.clip(points[corner], (4, 4), (16, 8))
    lost = rectangle.area - area(ring)
    assert lost == pytest.approx((1 - math.pi / 4) * 16, rel=0.06)
    on_arc = np.abs(np.linalg.norm(ring - center, axis=1) - 4.0) < 1e-9
    assert on_arc.sum() >= 7
    chords = np.linalg.norm(np.diff(ring, axis=0), axis=1)
    assert chords[on_arc[:-1] & on_arc[1:]].max() <= 1.0
    # The first edge still lies at y = 0.
    assert np.all(ring[:2, 1] == pytest.approx(0.0))
    assert ring[1, 0] > ring[0, 0]


def test_stadium_has_half_circles_left_and_right():
    ring = massing.stadium(0, 0, 40, 12, 1.0)
    assert area(ring) == pytest.approx(28 * 12 + math.pi * 36, rel=0.01)
    np.testing.assert_allclose(ring[:2], [(6, 0), (34, 0)], atol=1e-9)
    assert Polygon(ring).exterior.is_ccw


def test_chamfers_and_notches_take_their_corners_out():
    square = massing.rectangle(0, 0, 10, 10)
    assert area(massing.chamfered(square, 2.0)) == pytest.approx(100 - 8)
    notched = massing.notched(square, 2.0)
    assert area(notched) == pytest.approx(100 - 16)
    np.testing.assert_allclose(notched[:2], [(2, 0), (8, 0)])
    # Reflex corners stay.
    assert len(massing.chamfered(COURT, 1.0)) == 8 + 6


def test_mirrored_outline_keeps_front_and_turning():
    shape = massing.l_shape(0, 0, 20, 15, 6, 8)
    mirrored = massing.mirrored(shape)
    assert area(mirrored) == pytest.approx(area(shape))
    assert Polygon(mirrored).exterior.is_ccw
    np.testing.assert_allclose(mirrored[:2], [(0, 0), (20, 0)])
    assert Polygon(mirrored).contains(Point(17, 14))


@pytest.mark.parametrize("points", [TURNED, COURT], ids=["turned", "court"])
def test_prisms_are_closed_and_hold_their_volume(points):
    mesh = massing.prism(points, -0.5, 3.0, bottom=True)
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
    square = massing.rectangle(0, 0, 6, 6)
    small = massing.rectangle(2, 2, 4, 4)
    floor = massing.flat(square, 0.0, up=False)
    frustum = merge_meshes(massing.frustum(square, small, 0.0, 3.0), floor)
    assert volume(frustum) == pytest.approx(3.0 / 3 * (36 + 12 + 4))
    spire = merge_meshes(massing.spire(square, (3, 3), 0.0, 5.0), floor)
    assert volume(spire) == pytest.approx(5.0 / 3 * 36)
    wedge = merge_meshes(massing.sloped_prism(square, 0.0, 4.0, 0.25), floor)
    assert volume(wedge) == pytest.approx(36 * (1.0 + 4.0) / 2)
    for mesh in (frustum, spire, wedge):
        assert is_closed(merge(mesh))


def test_roof_pan_hollows_the_top_out():
    walls = massing.skirt(TURNED, TURNED, 0.0, 5.0)
    floor = massing.flat(TURNED, 0.0, up=False)
    pan = massing.roof_pan(TURNED, 4.0, 5.0, 0.3)
    mesh = merge_meshes(walls, floor, pan)
    inner = area(TURNED) - 2 * 0.3 * (14 + 9) + 4 * 0.09
    assert volume(mesh) == pytest.approx(5.0 * area(TURNED) - inner)
    assert is_closed(merge(mesh))


def test_revolved_profile_has_the_volume_of_its_polygons():
    profile = [(2.0, 0.0), (3.0, 1.5), (3.0, 4.0), (0.0, 6.0)]
    mesh = massing.revolved(profile, 12, (5.0, -3.0))
    floor = massing.regular_polygon(2.0, 12, (5.0, -3.0))
    mesh = merge_meshes(mesh, massing.flat(floor, 0.0, up=False))
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
    mesh = massing.extruded(profile, -3.0, 7.0)
    base = massing.rectangle(-3.0, 0.0, 7.0, 8.0)
    mesh = merge_meshes(mesh, massing.flat(base, 0.0, up=False))
    assert volume(mesh) == pytest.approx(10.0 * section)
    assert_closed(mesh)


def test_clockwise_outline_is_refused():
    with pytest.raises(ValueError, match="clockwise"):
        massing.flat(TURNED[::-1], 0.0)


@pytest.mark.parametrize(
    "solid",
    [
        details.canopy(0.5, 4.0, 1.4, 3.0),
        details.awning(1.0, 4.0, 1.2, 2.6, 3.5),
        details.steps(0.0, 3.0, 1.5, 0.8, 4),
    ],
    ids=["canopy", "awning", "steps"],
)
def test_details_are_wound_outwards_on_any_wall(solid):
    for edge in range(4):
        placed = details.WallFrame(TURNED, edge).place(solid)
        # Placing mirrors and turns faces, but leaves no solid inside out.
        rng = np.random.default_rng(edge)
        low, high = placed.vertices.min(axis=0), placed.vertices.max(axis=0)
        points = rng.uniform(low, high, (200, 3))
        found = winding_numbers(corners(placed), points)
        assert found.max() > 0.5
        assert found.min() > -0.5


def test_wall_frame_looks_outwards():
    wall = details.WallFrame(massing.rectangle(2, 3, 12, 9), 1)
    assert wall.length == pytest.approx(6.0)
    assert wall.heading == pytest.approx(math.pi / 2)
    np.testing.assert_allclose(wall.point(1.0, 0.5), (12.5, 4.0))
    box_ = massing.box(1.0, 2.0, 0.0, 0.5, 0.0, 3.0)
    placed = wall.place(box_, z=2.0)
    np.testing.assert_allclose(placed.vertices.min(axis=0), (12.0, 4.0, 2.0))
    np.testing.assert_allclose(placed.vertices.max(axis=0), (12.5, 5.0, 5.0))
    assert volume(placed) == pytest.approx(1.5)


def test_balcony_is_a_tray_open_to_the_wall():
    tray = details.balcony(1.0, 4.0, 1.2, 5.0, 1.0)
    wall = details.WallFrame(massing.rectangle(0, 0, 10, 6), 0)
    placed = wall.place(tray)
    back = massing.flat(massing.rectangle(1.0, -0.01, 4.0, 0.0), 0.0)
    assert placed.vertices[:, 1].min() == pytest.approx(-1.2)
    assert back.vertices[:, 1].max() == pytest.approx(0.0)
    # Views from the front, the side, below and into the tray.
    normals = np.cross(
        corners(placed)[:, 1] - corners(placed)[:, 0],
        corners(placed)[:, 2] - corners(placed)[:, 0],
    )
    total = normals.sum(axis=0) / 2
    # The open part is the section at the wall. Its area is the deficit: slab
    # and rails less the room between the rails.
    section = 3.0 * 1.2 - (3.0 - 0.24) * 1.0
    np.testing.assert_allclose(total, (0.0, -section, 0.0), atol=1e-9)
