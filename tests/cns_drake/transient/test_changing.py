"""Changes between drives: parked cars, leaves, poles, and all together."""

from helpers.transient_town import (
    ORIGIN,
    SLOPE_FROM,
    X_WT,
    change_maker,
    slope_height,
    write_transient_town,
)
import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import pytest
import shapely

from cns_drake.scenarios import TransientConfig
from cns_drake.scene import geometry_by_structure, load_world
from cns_drake.sensors import make_beam_pattern
from cns_drake.simulation import scan_world
from cns_drake.transient import change_world
from worlds.shapes import Way

# The drive leads through cars and roads, below z = 2.2 m or so.
_CORNERS = [
    X_WT @ [x, y, 0] for x, y in ((-90, -3), (90, -3), (90, 2), (-90, 2))
]
DRIVE = Way([(X_WT @ [x, -1, 0])[:2] for x in (-60, 60)])
LANES = shapely.Polygon([(x, y) for x, y, _ in _CORNERS])


@pytest.fixture(scope="module")
def sdf(tmp_path_factory):
    return write_transient_town(tmp_path_factory.mktemp("town"))


@pytest.fixture(scope="module")
def changed(sdf):
    """Returns the world after changes and its structures, cached."""
    return change_maker(sdf, DRIVE, LANES)


@pytest.fixture(scope="module")
def sloping(tmp_path_factory):
    """Returns the changes of a town whose lawn slopes down to a bay."""
    sdf = write_transient_town(tmp_path_factory.mktemp("slope"), slopes=True)
    return change_maker(sdf, DRIVE, LANES)


def middle_and_bottom(thing):
    """Returns y of the middle and the lowest z of a thing, in the town [m]."""
    hull = shapely.MultiPoint(thing.p_WPs[:, :2]).convex_hull
    box = hull.minimum_rotated_rectangle if hull.area > 1 else thing.footprint
    x, y = box.centroid.coords[0]
    return (X_WT.inverse() @ [x, y, 0])[1], thing.bottom - ORIGIN[2]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("switch", "prefix"), [("parked_cars", "parked_"), ("furniture", "new_")]
)
def test_on_a_slope_things_keep_their_height_above_it(sloping, switch, prefix):
    _, before = sloping()
    checked = 0
    for seed in range(3):
        _, after = sloping(**{switch: 1.0}, seed=seed)
        for name in after.keys() - before.keys():
            y, z = middle_and_bottom(after[name])
            y_old, z_old = middle_and_bottom(before[name.removeprefix(prefix)])
            if y_old > SLOPE_FROM:
                # Nothing moves over the kerb, into the bay.
                assert y > SLOPE_FROM
                rise = slope_height(y) - slope_height(y_old)
                assert z - z_old == pytest.approx(rise, abs=2e-3)
                checked += abs(rise) > 5e-3
    assert checked > 10


def places(things):
    """Name -> (N, 3) points of all that stands, to compare."""
    return {name: thing.p_WPs for name, thing in things.items()}


def of(things, prefixes):
    return {n: t for n, t in things.items() if n.startswith(prefixes)}


def same(first, second, but=()):
    """Returns whether two towns are equal except for some names."""
    first = {n: p for n, p in first.items() if not n.startswith(but)}
    second = {n: p for n, p in second.items() if not n.startswith(but)}
    return first.keys() == second.keys() and all(
        np.array_equal(p, second[name]) for name, p in first.items()
    )


def test_nothing_changes_by_default(sdf):
    world = load_world(sdf)
    ids = world.scene_graph.model_inspector().GetAllGeometryIds()
    assert change_world(world, TransientConfig(seed=9), DRIVE, LANES) is world
    assert world.scene_graph.model_inspector().GetAllGeometryIds() == ids


def test_at_one_no_parked_car_stays(changed):
    _, before = changed()
    world, after = changed(parked_cars=1.0)
    cars = {n: t for n, t in before.items() if t.semantic_class == "car"}
    assert len(cars) == 40
    assert not cars.keys() & after.keys()
    parked = {n: t for n, t in after.items() if t.semantic_class == "car"}
    assert parked.keys() <= {f"parked_{name}" for name in cars}
    # Some cars left. A few of the others are the same, most are not.
    assert 20 <= len(parked) < 36
    moved = [
        name
        for name, car in parked.items()
        if len(car.p_WPs) == len(cars[name.removeprefix("parked_")].p_WPs)
    ]
    assert 2 <= len(moved) < 25
    for name in moved:
        old = cars[name.removeprefix("parked_")]
        shift = np.linalg.norm(parked[name].p_WPs - old.p_WPs, axis=1)
        assert shift.max() > 0.1
    for entry in world.structures:
        is_of_it = entry.name in cars or entry.name in parked
        assert entry.causes == (("parked_cars",) if is_of_it else ())
    assert same(places(before), places(after), but=("car", "parked"))


@pytest.mark.slow
def test_a_part_changes_by_the_seed_and_by_nothing_else(changed):
    _, whole = changed(parked_cars=1.0)
    counts = []
    for seed in (1, 2, 3, 4):
        _, after = changed(parked_cars=0.3, seed=seed)
        counts.append(40 - sum(n.startswith("car_") for n in after))
    # 160 draws: five standard deviations.
    assert abs(sum(counts) - 48) < 5 * np.sqrt(160 * 0.3 * 0.7)
    assert len(set(counts)) > 1
    # The cars that change also change, in the same way, at a greater share.
    _, some = changed(parked_cars=0.3)
    fresh = {n: t for n, t in some.items() if n.startswith("parked")}
    assert fresh
    for name, car in fresh.items():
        assert np.array_equal(car.p_WPs, whole[name].p_WPs)


@pytest.mark.slow
def test_each_switch_is_independent_of_the_others(changed):
    world, all_at_once = changed(parked_cars=0.6, leaves=0.4, furniture=0.7)
    _, parked = changed(parked_cars=0.6)
    _, furniture = changed(furniture=0.7)
    _, leaves = changed(leaves=0.4)
    for prefixes, alone in (
        (("car", "parked"), parked),
        (("lamp", "sign", "new"), furniture),
        (("tree", "shrub"), leaves),
    ):
        assert same(
            {
                n: p
                for n, p in places(all_at_once).items()
                if n.startswith(prefixes)
            },
            {n: p for n, p in places(alone).items() if n.startswith(prefixes)},
        )
    ids = [entry.instance for entry in world.structures]
    assert len(ids) == len(set(ids))


def test_the_same_twice(sdf, changed):
    switches = {"parked_cars": 0.6, "leaves": 0.4, "furniture": 0.7}
    world, things = changed(**switches)
    again = change_world(
        load_world(sdf), TransientConfig(**switches), DRIVE, LANES
    )
    assert list(again.structures) == list(world.structures)
    assert same(places(things), places(geometry_by_structure(again)))


def crown(things, name):
    parts = {part.name: part.geometry.surface for part in things[name].parts}
    return parts.get("crown") or parts.get("leaves")


def test_leaf_off_keeps_wood_and_the_rest(changed):
    _, before = changed()
    _, bare = changed(leaves=0.0)
    for k in range(20):
        tree = bare[f"tree_{k:03d}"]
        assert [part.name for part in tree.parts] == ["wood"]
        old = before[tree.name].parts
        wood = next(part for part in old if part.name == "wood")
        assert np.array_equal(tree.parts[0].p_WPs, wood.p_WPs)
        # The twigs of a shrub stay.
        ratio = len(crown(bare, f"shrub_{k:03d}").triangles) / len(
            crown(before, f"shrub_{k:03d}").triangles
        )
        assert ratio == pytest.approx(0.1, abs=0.01)
    assert same(places(before), places(bare), but=("tree", "shrub"))


@pytest.mark.parametrize("part", [0.25, 0.7])
def test_leaves_that_are_left_hang_where_they_hung(changed, part):
    _, before = changed()
    _, after = changed(leaves=part)
    for name in ("tree_004", "shrub_007"):
        old, new = crown(before, name), crown(after, name)
        assert len(new.triangles) == round(part * len(old.triangles))
        known = {
            corners.tobytes()
            for corners in np.round(old.p_GVset[old.triangles], 4) + 0.0
        }
        found = np.round(new.p_GVset[new.triangles], 4) + 0.0
        # Rounding may differ for a few.
        count = sum(corners.tobytes() in known for corners in found)
        assert count > 0.97 * len(found)


def test_furniture_goes_at_most_2_m(changed):
    _, before = changed()
    _, after = changed(furniture=1.0)
    kinds = ("pole", "traffic-sign")
    old = {n: t for n, t in before.items() if t.semantic_class in kinds}
    assert len(old) == 40
    stayed = old.keys() & after.keys()
    assert len(stayed) <= 4
    moved = old.keys() - stayed
    for name in moved:
        new = after[f"new_{name}"]
        shift = new.footprint.centroid.distance(old[name].footprint.centroid)
        assert 0.29 < shift < 2.01
        assert not new.footprint.intersects(LANES)
        assert new.bottom == pytest.approx(old[name].bottom, abs=1e-6)
        for thing in before.values():
            if thing.semantic_class in ("car", "building", "vegetation"):
                assert not thing.footprint.intersects(new.footprint)
    assert same(places(before), places(after), but=("lamp", "sign", "new"))


@pytest.mark.parametrize(
    "switches",
    [
        {"parked_cars": 0.5, "leaves": 0.5, "furniture": 0.5},
        {"height_limit": 5.0},
        {"scaffolds": 0.6, "works": 0.6, "snow": 0.15},
    ],
)
def test_points_that_no_changed_thing_could_hide_are_identical(sdf, switches):
    """Beams that meet no changed object before or after have equal points."""
    pattern = make_beam_pattern("vlp-16")
    X_WS = X_WT @ RigidTransform(RollPitchYaw(0, 0, 1.0), [20.0, 0.0, 1.6])
    config = TransientConfig(**switches)
    old_world = load_world(sdf)
    new_world = change_world(load_world(sdf), config, DRIVE, LANES)
    causes = {e.instance for e in new_world.structures if e.causes}
    scans = [
        scan_world(world, X_WS, pattern) for world in (old_world, new_world)
    ]
    fixed = []
    for scan in scans:
        keys = zip(scan["ring"].tolist(), scan["t"].tolist(), strict=True)
        fixed.append(dict(zip(keys, scan.tolist(), strict=True)))
    old, new = fixed
    names = scans[0].dtype.names
    instance = names.index("instance")
    differing = 0
    for key in old.keys() | new.keys():
        pair = old.get(key), new.get(key)
        met = {point[instance] for point in pair if point is not None}
        if met & causes:
            differing += pair[0] != pair[1]
        else:
            assert pair[0] == pair[1]
    assert differing > 300


def test_what_a_world_lacks_is_said(tmp_path):
    (tmp_path / "plain.sdf").write_text(
        '<sdf version="1.9"><model name="m"><static>true</static>'
        '<link name="l"><visual name="a"><geometry><box><size>9 9 1</size>'
        "</box></geometry></visual></link></model></sdf>"
    )
    names = ("parked_cars", "leaves", "furniture", "scaffolds", "works", "snow")
    config = TransientConfig(**dict.fromkeys(names, 0.1))
    world = change_world(
        load_world(tmp_path / "plain.sdf"), config, DRIVE, LANES
    )
    noted = [note.split(":")[:2] for note in world.notes]
    assert noted == [["transient", f" {name}"] for name in names]
