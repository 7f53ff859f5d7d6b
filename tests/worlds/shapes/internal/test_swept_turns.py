"""Turning round: room, steering, faults; the oracle is the driven curve."""

from helpers.turning_roads import drive, driven, leg, network_of
import numpy as np
import pytest

from worlds.shapes import TIGHTEST_RADIUS
from worlds.shapes.paths.car_outline import swept_area

# Numbers of lanes, and lanes of the turn; the loop is as wide as their
# distance.
ROOMY = {
    "a dead end": ({}, [leg("up"), leg("up", "backward")]),
    "a dead end behind a bend": (
        {"lane_width": 4.5},
        [leg("up"), leg("up", "backward")],
    ),
    "a wide street": (
        {"lanes": [2, 2]},
        [leg("in", end=50), leg("in", "backward")],
    ),
    "a wide street's junction": (
        {"lanes": [2, 2]},
        [leg("in"), leg("in", "backward")],
    ),
    "from inner lane to outer": (
        {"lanes": [3, 3]},
        [leg("in", end=50), leg("in", "backward", 2)],
    ),
    "twice": (
        {"lanes": [2, 2]},
        [leg("in", end=60), leg("in", "backward", end=70), leg("in")],
    ),
    "three lanes and a half circle": (
        {"lanes": [3, 3]},
        [leg("in", lane=2, end=50), leg("in", "backward", 2)],
    ),
}


@pytest.mark.parametrize("where", ROOMY)
def test_the_car_turns_round_on_the_carriageway(tmp_path, where):
    style, legs = ROOMY[where]
    network = network_of(tmp_path, **style)
    places, curvature = driven(drive(network, *legs))
    assert np.abs(curvature).max() <= 1 / TIGHTEST_RADIUS
    # The whole car stays between the kerbs at every time.
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    moving = places[np.concatenate([[True], steps > 1e-4])]
    outside = swept_area(moving).difference(network.areas.lane_area)
    assert outside.area < 0.01
    for point, one, end in (
        (places[0], legs[0], "entry"),
        (places[-1], legs[-1], "exit"),
    ):
        road = network.roads[one["road"]]
        lane = road.lane_end(one["direction"], one["lane"], end)
        np.testing.assert_allclose(point, lane[:2], atol=1e-6)
