"""Roadworks along kerbs."""

from helpers.transient_town import DRIVE, LANES, in_town, new_things
import numpy as np
import pytest

from cns_drake.scenarios import TransientConfig
from cns_drake.scene import geometry_by_structure, load_world
from cns_drake.transient import change_world
from worlds.shapes import GroundSurface


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
        assert DRIVE.distance(outline) > 1.3
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
    assert (
        geometry_by_structure(after).keys()
        == geometry_by_structure(before).keys()
    )
