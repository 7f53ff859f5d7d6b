"""Objects added between drives: scaffolds, roadworks, snow."""

from helpers.transient_town import (
    LANES,
    X_WT,
    change_maker,
    new_things,
    slope_height,
    write_transient_town,
)
import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import pytest
import shapely

from cns_drake.city.geometry.structures import ROOT_DEPTH
from cns_drake.city.geometry.upper_sides import turned_up, unit_normals
from cns_drake.scenarios.scenario import TransientConfig
from cns_drake.scene.world import load_world
from cns_drake.sensors.lidar.presets import make_beam_pattern
from cns_drake.simulation.scanning import scan_world
from cns_drake.transient.changing import change_world
from cns_drake.transient.ground_surface import GroundSurface
from cns_drake.transient.world_structures import read_structures

DRIVE = shapely.LineString([(X_WT @ [x, -0.5, 0])[:2] for x in (-60, 80)])


@pytest.fixture(scope="module")
def sdf(tmp_path_factory):
    return write_transient_town(tmp_path_factory.mktemp("town"))


@pytest.fixture(scope="module")
def changed(sdf):
    """Returns the world after changes and its structures, cached."""
    return change_maker(sdf, DRIVE, LANES)


def in_town(points):
    """Points of the world in the frame of the town, where x is the street."""
    return (X_WT.inverse() @ points.T).T


def test_every_front_along_the_drive_has_a_scaffold_at_one(changed):
    """The town's houses are boxes 15 m wide and 8 m high, fronts at y = 20."""
    _, before = changed()
    fresh = new_things(changed, scaffolds=1.0)
    houses = [n for n, t in before.items() if t.semantic_class == "building"]
    assert fresh.keys() == {f"scaffold_{name}" for name in houses}
    for name, scaffold in fresh.items():
        assert scaffold.semantic_class == "other-structure"
        p_TPs = in_town(scaffold.p_WPs)
        middle = 5 * int(name[-3:])
        assert p_TPs[:, 0].min() == pytest.approx(middle - 7.5, abs=0.05)
        assert p_TPs[:, 0].max() == pytest.approx(middle + 7.5, abs=0.05)
        assert 18.7 < p_TPs[:, 1].min() < p_TPs[:, 1].max() < 19.9
        # Three or four lifts of 2 m, and a rail of 1 m.
        assert p_TPs[:, 2].max() == pytest.approx(9.075, abs=0.01)


def test_a_scaffold_stands_on_the_lowest_ground_below_it(tmp_path):
    sdf = write_transient_town(tmp_path, slopes=True)
    fresh = new_things(change_maker(sdf, DRIVE, LANES), scaffolds=1.0)
    assert fresh
    for scaffold in fresh.values():
        p_TPs = in_town(scaffold.p_WPs)
        foot = slope_height(p_TPs[:, 1].min()) - ROOT_DEPTH
        assert p_TPs[:, 2].min() == pytest.approx(foot, abs=0.02)


@pytest.mark.slow
def test_fronts_are_drawn_one_by_one(changed):
    counts = [
        len(new_things(changed, scaffolds=0.5, seed=seed)) for seed in range(4)
    ]
    # 20 draws that differ: five standard deviations.
    assert abs(sum(counts) - 10) < 5 * np.sqrt(20 * 0.25)
    assert len(set(counts)) > 1
    some = new_things(changed, scaffolds=0.5)
    whole = new_things(changed, scaffolds=1.0)
    for name, thing in some.items():
        assert np.array_equal(thing.p_WPs, whole[name].p_WPs)


def test_roadworks_leave_the_lanes_free(changed):
    fresh = new_things(changed, works=1.0)
    kinds = {name.split("_", 3)[3].rsplit("_", 1)[0] for name in fresh}
    assert {"fence", "kerb"} <= kinds
    assert kinds & {"skip", "excavator", "soil_heap", "brick_pallets"}
    sites = {tuple(name.split("_")[:3]) for name in fresh}
    # 140 m of kerb on both sides; parked cars take some of the room.
    assert 5 < len(sites) < 30
    _, before = changed()
    cars = [t.footprint for t in before.values() if t.semantic_class == "car"]
    for name, thing in fresh.items():
        outline = thing.outline
        assert outline.distance(DRIVE) > 1.3
        y = abs(in_town(thing.p_WPs)[:, 1])
        if name.endswith("kerb"):
            assert y.min() == pytest.approx(2.7, abs=0.02)
            assert y.max() == pytest.approx(3.0, abs=0.02)
        else:
            assert y.min() > 3.0
            assert y.max() < 9.0
        assert not any(thing.footprint.intersects(car) for car in cars)


def test_a_part_of_the_works(changed):
    whole = new_things(changed, works=1.0)
    some = new_things(changed, works=0.4)
    assert 0 < len(some) < len(whole)
    for name, thing in some.items():
        assert np.array_equal(thing.p_WPs, whole[name].p_WPs)


def test_over_slits_of_the_ground_there_are_no_works(sdf, monkeypatch):
    """An object at a height of NaN would hide the whole world from rays."""

    def heights(ground, xy, *, of_road=None):
        return np.full(len(xy), np.nan)

    monkeypatch.setattr(GroundSurface, "heights", heights)
    config = TransientConfig(works=1.0)
    before = load_world(sdf)
    after = change_world(before, config, DRIVE, LANES)
    assert read_structures(after).keys() == read_structures(before).keys()


def test_kerbs_and_heights_of_a_plane_road(changed):
    """The oracle is where the road lies: between y = -3 and 3 of the town."""
    _, before = changed()
    ground = GroundSurface(before, DRIVE.buffer(50))
    assert ground.carriageway.area == pytest.approx(6 * 200, rel=0.01)
    kerbs = list(ground.kerbs(1.0))
    assert len(kerbs) == 1  # Once round.
    R = X_WT.rotation().matrix()[:2, :2]
    for kerb in kerbs:
        x, y = R.T @ (kerb.points - X_WT.translation()[:2]).T
        straight = abs(x) < 98
        side = np.sign(y[straight])
        assert np.allclose(y[straight], 3.0 * side, atol=1e-3)
        out = (kerb.outwards @ R)[straight]
        assert np.allclose(out, np.column_stack([0 * side, side]), atol=1e-3)
    at = ((5, 1), (5, 8), (5, -9))
    places = np.array([(X_WT @ [x, y, 0])[:2] for x, y in at])
    road = ground.heights(places, of_road=True)
    assert road[0] == pytest.approx(0.4)
    assert np.isnan(road[1:]).all()
    lawn = ground.heights(places, of_road=False)
    assert lawn[1] == pytest.approx(0.45)
    assert np.isnan(lawn[[0, 2]]).all()


def test_ground_is_ground_whichever_way_round_it_is():
    rng = np.random.default_rng(2)
    corners = rng.uniform(-1, 1, (50, 3, 3))
    faced = turned_up(corners)
    assert (unit_normals(corners)[:, 2] < 0).sum() > 10
    assert np.allclose(
        unit_normals(faced)[:, 2], abs(unit_normals(corners)[:, 2])
    )
    assert np.array_equal(np.sort(faced, axis=1), np.sort(corners, axis=1))


@pytest.mark.parametrize("depth", [0.1, 0.4])
def test_snow_lies_on_all_but_roads_and_plants(sdf, changed, depth):
    world, after = changed(snow=depth)
    _, before = changed()
    assert before.keys() | {"snow_banks"} == after.keys()
    tops = {n: t.p_WPs[:, 2].max() for n, t in before.items()}
    for name, thing in after.items():
        kind = thing.semantic_class
        rise = thing.p_WPs[:, 2].max() - tops.get(name, 0)
        if name == "snow_banks":
            continue
        covered = kind in ("car", "building") or name == "lawn"
        assert rise == pytest.approx(depth if covered else 0.0, abs=2e-3), name
        causes = world.structures[name].causes
        assert causes == (("snow",) if covered else ())
    # The lawn is raised as a whole, and white; a roof has a slab on it.
    lawn = after["lawn"].parts[0].geometry
    assert lawn.rgb[0] > 0.9
    assert lawn.reflectivity == 0.9
    roof = next(p for p in after["house_000"].parts if p.name.endswith("snow"))
    p_TPs = in_town(roof.p_WPs)
    assert np.ptp(p_TPs[:, 0]) == pytest.approx(15, abs=0.01)
    assert np.ptp(p_TPs[:, 1]) == pytest.approx(8, abs=0.01)
    assert p_TPs[:, 2].min() == pytest.approx(8.5, abs=1e-3)


def test_banks_lie_along_kerbs_and_nowhere_else(changed):
    _, after = changed(snow=0.2)
    banks = after["snow_banks"]
    assert banks.semantic_class == "terrain"
    p_TPs = in_town(banks.p_WPs)
    along = abs(p_TPs[:, 0]) < 98
    y = abs(p_TPs[along, 1])
    assert y.min() == pytest.approx(2.7, abs=0.01)
    assert y.max() == pytest.approx(4.1, abs=0.01)
    z = p_TPs[along, 2]
    # Snow banks rise from the road, above the snow beside them.
    assert z.min() == pytest.approx(0.0, abs=1e-3)
    assert 0.35 < z.max() < 0.6
    assert shapely.MultiPoint(banks.p_WPs[:, :2]).distance(DRIVE) > 1.3


@pytest.mark.slow
def test_points_that_no_changed_thing_could_hide_are_identical(sdf):
    """Beams that meet no changed object before or after have equal points."""
    pattern = make_beam_pattern("vlp-16")
    X_WS = X_WT @ RigidTransform(RollPitchYaw(0, 0, 1.0), [20.0, 0.0, 1.6])
    config = TransientConfig(scaffolds=0.6, works=0.6, snow=0.15)
    old_world = load_world(sdf)
    new_world = change_world(load_world(sdf), config, DRIVE, LANES)
    causes = {e.instance for e in new_world.structures if e.causes}
    clouds = []
    for world in (old_world, new_world):
        scan = scan_world(world, X_WS, pattern)
        keys = zip(scan["ring"].tolist(), scan["t"].tolist(), strict=True)
        clouds.append(dict(zip(keys, scan, strict=True)))
    old, new = clouds
    same = 0
    for key in old.keys() | new.keys():
        pair = [cloud[key] for cloud in clouds if key in cloud]
        if not {int(point["instance"]) for point in pair} & causes:
            assert len(pair) == 2
            assert pair[0] == pair[1]
            same += 1
    assert same > 300


def test_what_a_world_lacks_is_said(tmp_path):
    (tmp_path / "plain.sdf").write_text(
        '<sdf version="1.9"><model name="m"><static>true</static>'
        '<link name="l"><visual name="a"><geometry><box><size>9 9 1</size>'
        "</box></geometry></visual></link></model></sdf>"
    )
    config = TransientConfig(snow=0.1, works=0.9, scaffolds=0.1)
    plain = load_world(tmp_path / "plain.sdf")
    world = change_world(plain, config, DRIVE, LANES)
    noted = [note.split(":")[:2] for note in world.notes]
    assert noted == [
        ["transient", f" {name}"] for name in ("scaffolds", "works", "snow")
    ]
