"""Scaffolds in front of the buildings along a drive."""

from helpers.transient_town import (
    DRIVE,
    LANES,
    change_maker,
    in_town,
    new_things,
    slope_height,
    write_transient_town,
)
import numpy as np
import pytest


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
        foot = slope_height(p_TPs[:, 1].min()) - 0.3
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
