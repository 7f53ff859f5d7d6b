import numpy as np
import pytest
from shapely.geometry import box

from cns_drake.city import Assembly, Finish, Site
from cns_drake.city.buildings import house_heights
from cns_drake.city.facades import bays, outlines, wing_roofs
from cns_drake.city.facades.reliefs import Arch, Patch
from cns_drake.city.facades.wing_roofs import add_roof
from cns_drake.city.facades.wing_walls import Openings
from cns_drake.city.facades.wings import Roof, Wing, free_stretches
from cns_drake.city.geometry.mesh import box_mesh

HALL = Wing.at((0, 0, 20, 8), 6.0, 9.0, Roof())
# The porch stands at the middle of the hall's front, lower than its walls.
PORCH = Wing.at((8, -3, 12, 0.1), 2.5, 3.5, Roof())


GROUND = box(0, 0, 9, 9)


def assembly(name, **colours):
    site = Site(GROUND, name)
    result = Assembly(site, np.random.default_rng(0), walls=Finish((9, 9, 9)))
    result.declare_materials(
        **{part: Finish(rgb) for part, rgb in colours.items()}
    )
    return result


def test_other_wings_hide_walls_up_to_their_tops():
    boxes = (HALL, PORCH)
    assert free_stretches(HALL, 0, boxes, 1.0) == [(0.0, 8.0), (12.0, 20.0)]
    assert free_stretches(HALL, 0, boxes, 3.6) == [(0.0, 20.0)]
    assert free_stretches(HALL, 2, boxes, 1.0) == [(0.0, 20.0)]
    assert free_stretches(PORCH, 2, boxes, 1.0) == []
    inside = free_stretches(PORCH, 1, boxes, 1.0)
    np.testing.assert_allclose(inside, [(0.0, 3.0)])


def test_blind_walls_have_no_free_part():
    wing = Wing.at((0, 0, 20, 8), 6.0, 9.0, Roof(), blind={1})
    assert free_stretches(wing, 1, (wing,), 1.0) == []
    assert free_stretches(wing, 3, (wing,), 1.0) == [(0.0, 8.0)]


def test_a_row_keeps_off_hidden_walls_and_a_door_replaces_windows():
    openings = Openings(assembly("h"), HALL, (HALL, PORCH))
    openings.add_bays((0,), 1.0, 2.0, [bays.window(1.0, 1.0, 2.0, 0.1)])
    row = openings.layout(0, 20.0)
    assert len(row) == 6
    assert all(r.x1 < 8.0 or r.x0 > 12.0 for r in row)
    openings.replace_by_bay(
        0, 3.0, 1.6, lambda a, b: [Patch(a, b, 0.0, 2.2, 0.3)]
    )
    left = [r for r in openings.layout(0, 20.0) if r.x1 < 8.0]
    door = left.pop()
    assert door == Patch(2.2, 3.8, 0.0, 2.2, 0.3)
    assert all(r.x1 < 2.21 or r.x0 > 3.79 for r in left)
    openings.clear(0, 0.0, 8.0, 0.0, 6.0)
    assert all(r.x0 > 12.0 for r in openings.layout(0, 20.0))


def test_flat_wall_comes_below_an_arch():
    openings = Openings(assembly("h"), HALL)
    arch = Arch(2.0, 3.0, 0.0, 2.0, 2.5, 0.3)
    openings.add_reliefs(0, [arch])
    assert openings.layout(0, 20.0) == [Patch(2.0, 3.0, 0.0, 2.5, 0.0), arch]


@pytest.mark.parametrize("along_y", [False, True])
def test_gables_stand_below_the_ends_of_the_ridge(along_y):
    wing = Wing.at((0, 0, 6, 6), 4.0, 7.0, Roof("gable", along_y, 0.4, 0.3))
    house = assembly("h", walls=(1, 1, 1), roof=(0, 0, 0))
    add_roof(house, wing)
    meshes = house.to_model(GROUND).meshes
    walls = meshes["h_walls"].vertices
    across = walls[:, 0] if along_y else walls[:, 1]
    ends = walls[:, 1] if along_y else walls[:, 0]
    assert set(np.round(ends, 6)) == {0.0, 6.0}
    top = walls[:, 2].argmax()
    assert across[top] == pytest.approx(3.0)
    roof = meshes["h_roof"].vertices
    reach = np.ptp(roof, axis=0)
    assert reach[int(along_y)] == pytest.approx(6.6)
    assert reach[int(not along_y)] == pytest.approx(6.8)


def test_a_mirrored_wing():
    wing = Wing.at((1, 0, 4, 8), 3.0, 4.0, Roof(), blind={3, 2})
    mirrored = wing.mirrored(10.0)
    assert (mirrored.x0, mirrored.x1) == (6.0, 9.0)
    assert mirrored.blind == {1, 2}
    assert mirrored.mirrored(10.0) == wing


def test_dormers_stay_below_the_ridge_and_on_the_slope():
    for kind in ("gable", "shed", "flat"):
        house = assembly("d", walls=(1, 1, 1), glass=(0, 0, 1), roof=(1, 0, 0))
        wing_roofs.add_dormers(house, HALL, 2.0, 18.0, 3, kind)
        meshes = house.to_model(GROUND).meshes
        corners = np.vstack([m.vertices for m in meshes.values()])
        assert corners[:, 2].max() < 9.0
        assert corners[:, 0].min() > 2.0
        assert corners[:, 0].max() < 18.0
        panes = meshes["d_glass"]
        assert len(panes.faces) == 3
        # The slope rises from 6.2 m above the front to the ridge at y = 4.
        slope = 6.2 + (9.0 - 6.2) * panes.vertices[:, 1] / 4.0
        assert (panes.vertices[:, 2] > slope).all()


def test_no_dormer_on_a_flat_slope():
    wing = Wing.at((0, 0, 20, 16), 6.0, 8.0, Roof())
    house = assembly("d", walls=(1, 1, 1))
    wing_roofs.add_dormers(house, wing, 0.0, 20.0, 3, "gable")
    assert house.to_model(GROUND).parts == ()


@pytest.mark.parametrize(("height", "storeys"), [(5.0, 1), (9.0, 2), (12.5, 3)])
def test_storeys_leave_the_roof_its_pitch(height, storeys):
    # A span of 8 m at 35 degrees rises by 2.8 m; a storey is 2.65 m high.
    assert house_heights.storeys_for(height, 0.3, 8.0, 35.0) == storeys
    top = house_heights.wall_top_for(height, 0.3, 8.0, storeys)
    assert top <= height - house_heights.ROOF_M - 0.08 * 8.0 + 1e-9


def test_each_material_becomes_one_part():
    house = assembly("h", a=(1, 0, 0), b=(0, 1, 0), c=(0, 0, 1))
    house.add_to("b", box_mesh((1, 1, 1)))
    house.add_to("a", box_mesh((1, 1, 1)), box_mesh((1, 2, 3), (5, 0, 0)))
    house.turn((1.0, 2.0, 0.0), np.pi / 2)
    model = house.to_model(GROUND)
    assert [(p.name, p.rgb) for p in model.parts] == [
        ("a", (1, 0, 0)),
        ("b", (0, 1, 0)),
    ]
    vertices = model.meshes["h_a"].vertices
    np.testing.assert_allclose(vertices.max(axis=0), [2.0, 7.5, 1.5])
    with pytest.raises(ValueError, match="unknown material"):
        house.add_to("d", box_mesh((1, 1, 1)))


def test_corners_without_neighbours_are_free():
    footprint = box(0, 0, 10, 10)
    assert Site(footprint, "s").free_corners == [0, 1]
    assert Site(footprint, "s", frozenset({1})).free_corners == [0]
    assert Site(footprint, "s", frozenset({3})).free_corners == [1]
    assert Site(footprint, "s", frozenset({0})).free_corners == []


def test_edges_of_a_plan_on_edges_of_its_site():
    site = outlines.rectangle(0, 0, 10, 8)
    plan = np.array([(2, 0), (10, 0), (10, 8), (0, 8), (0, 2)])
    assert outlines.edges_on(plan, site, {1, 3}) == {1, 3}
    assert outlines.edges_on(plan, site, {0}) == {0}
    assert outlines.edges_on(outlines.inset(plan, 0.1), site, {0, 1}) == set()
