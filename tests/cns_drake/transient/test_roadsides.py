"""What fills the room beside kerbs."""

from helpers.transient_town import (
    DRIVE,
    LANES,
    X_WT,
    box_shape,
    change_maker,
    drive_along_street,
    new_things,
    slope_height,
    visual,
    write_transient_town,
    write_world,
)
import numpy as np
import pytest
import shapely

from worlds.shapes import Way


def kind_of(name):
    """The row of a thing, of names such as roadsides_+3_-2_hedge."""
    return name.split("_")[3]


def test_all_rows_stand_in_free_room_beside_the_kerb(changed):
    _, before = changed()
    fresh = new_things(changed, roadsides=1.0)
    kinds = {kind_of(name) for name in fresh}
    assert kinds == {"garage", "hedge", "wall", "shrub", "bush", "tree", "car"}
    others = [
        thing.footprint
        for thing in before.values()
        if thing.semantic_class not in ("road", "terrain")
    ]
    feet = [thing.footprint for thing in fresh.values()]
    for k, foot in enumerate(feet):
        assert not shapely.intersects(LANES, foot)
        assert not shapely.intersects(others, foot).any()
        assert not shapely.intersects(feet[:k] + feet[k + 1 :], foot).any()


def test_cars_stand_nearest_to_the_kerb_and_along_it(changed):
    cars = {
        name: thing
        for name, thing in new_things(changed, roadsides=1.0).items()
        if kind_of(name) == "car"
    }
    assert len(cars) > 10
    for car in cars.values():
        p_TPs = (X_WT.inverse() @ car.p_WPs.T).T
        size = np.ptp(p_TPs, axis=0)
        assert size[0] > 1.5 * size[1]
        # The kerb is at 3.0; mirrors reach farthest.
        assert 3.0 < abs(p_TPs[:, 1]).min() < 4.0


def test_the_seed_draws_cars_alone(changed):
    one, other = (
        new_things(changed, roadsides=1.0, seed=seed) for seed in (1, 2)
    )
    differ = {
        kind_of(name)
        for name in one.keys() | other.keys()
        if name not in one
        or name not in other
        or not np.array_equal(one[name].p_WPs, other[name].p_WPs)
    }
    assert differ == {"car"}


def test_a_part_has_some_of_the_things_of_the_whole(changed):
    whole = new_things(changed, roadsides=1.0)
    some = new_things(changed, roadsides=0.4)
    for name, thing in some.items():
        assert np.array_equal(thing.p_WPs, whole[name].p_WPs)
    # Each stands by a draw of its own: five standard deviations.
    expected = 0.4 * len(whole)
    spread = np.sqrt(0.24 * len(whole))
    assert abs(len(some) - expected) < 5 * spread


@pytest.mark.slow
def test_above_one_plants_come_again_in_the_room_that_is_left(changed):
    first = new_things(changed, roadsides=1.0)
    some = new_things(changed, roadsides=2.4)
    third = new_things(changed, roadsides=3.0)
    for fewer, more in ((first, some), (some, third)):
        assert fewer.keys() < more.keys()
        for name, thing in fewer.items():
            assert np.array_equal(thing.p_WPs, more[name].p_WPs)
    # The last time, each stands by a draw of its own: five standard deviations.
    last, whole = (
        sum(name.endswith("_3") for name in things) for things in (some, third)
    )
    assert abs(last - 0.4 * whole) < 5 * np.sqrt(0.24 * whole)
    plants = [thing for name, thing in third.items() if name not in first]
    assert {thing.semantic_class for thing in plants} == {"vegetation"}
    others = [thing.footprint for thing in first.values()]
    feet = [thing.footprint for thing in plants]
    for k, foot in enumerate(feet):
        assert not shapely.intersects(LANES, foot)
        assert not shapely.intersects(others, foot).any()
        assert not shapely.intersects(feet[:k] + feet[k + 1 :], foot).any()


def test_two_drives_along_a_road_have_the_same_things(sdf, changed):
    """Things that only one of them has are far from the other."""
    mine = new_things(changed, roadsides=1.0)
    elsewhere = drive_along_street(-20, 20)
    theirs = new_things(change_maker(sdf, elsewhere, LANES), roadsides=1.0)
    assert 20 < len(theirs) < len(mine)
    for name, thing in theirs.items():
        assert np.allclose(thing.p_WPs, mine[name].p_WPs, atol=1e-9)
    for name in mine.keys() - theirs.keys():
        # Stretches end 30 m from a drive, and things up to 14 m behind them.
        assert elsewhere.distance(mine[name].footprint) > 30.0 - 14.0


def test_other_switches_change_what_stands_there(changed):
    world, _ = changed(roadsides=1.0, parked_cars=1.0)
    causes = {
        entry.causes
        for entry in world.structures
        if entry.name.startswith("roadsides") and kind_of(entry.name) == "car"
    }
    assert causes == {("roadsides", "parked_cars")}


def test_things_stand_on_a_slope(tmp_path):
    sdf = write_transient_town(tmp_path, slopes=True)
    fresh = new_things(change_maker(sdf, DRIVE, LANES), roadsides=1.0)
    checked = 0
    for name, thing in fresh.items():
        p_TPs = (X_WT.inverse() @ thing.p_WPs.T).T
        if kind_of(name) == "tree" and p_TPs[:, 1].min() > 4.5:
            trunk = p_TPs[p_TPs[:, 2] < p_TPs[:, 2].min() + 0.1]
            foot = slope_height(trunk[:, 1].mean())
            assert foot - 0.6 < trunk[:, 2].min() < foot
            checked += 1
    assert checked


def test_nothing_stands_on_the_carriageway_beyond_a_strip(tmp_path):
    """Cars beside the inner kerbs would reach over the strip of 1.2 m."""
    visuals = [
        visual(f"{side}/plate", box_shape(200, 5, 1), 0, y, -0.5)
        for side, y in (("north", 3.1), ("south", -3.1))
    ]
    visuals.append(visual("lawn/plate", box_shape(200, 60, 1), 0, 0, -0.6))
    folder = write_world(
        tmp_path,
        visuals,
        {"north": "road", "south": "road", "lawn": "terrain"},
        (0.0,) * 6,
    )
    line = Way([(-60, -4.5), (60, -4.5)])
    fresh = new_things(
        change_maker(folder, line, shapely.Polygon()), roadsides=1.0
    )
    assert len(fresh) > 30
    for thing in fresh.values():
        y = np.abs(shapely.get_coordinates(thing.footprint)[:, 1])
        assert y.min() > 5.6 or y.max() < 0.6


def test_without_roads_there_is_a_note(tmp_path, sdf):
    table = (sdf.parent / "structures.csv").read_text()
    (tmp_path / "structures.csv").write_text(
        table.replace(",road,road", ",road,terrain")
    )
    (tmp_path / "street.sdf").write_text(sdf.read_text())
    world, _ = change_maker(tmp_path / "street.sdf", DRIVE, LANES)(
        roadsides=1.0
    )
    assert [note.split(":")[:2] for note in world.notes] == [
        ["transient", " roadsides"]
    ]


@pytest.mark.night
@pytest.mark.slow
def test_what_is_put_up_loses_its_leaves(changed):
    """It changes as all else does, with the part of its leaves that is left."""
    whole = new_things(changed, roadsides=1.0)
    _, bare = changed(roadsides=1.0, leaves=0.3)
    assert bare.keys() >= whole.keys()
    fewer = {
        kind_of(n) for n in whole if len(bare[n].p_WPs) < len(whole[n].p_WPs)
    }
    assert {"shrub", "tree"} <= fewer
    assert not fewer & {"garage", "wall", "car"}
    changed(roadsides=1.0, leaves=0.0, snow=0.1)
