"""Turning round: room, steering, faults; the oracle is the driven curve."""

import numpy as np
import pytest
import yaml

from cns_drake.motion import Trajectory
from cns_drake.roads import (
    POINT_SPACING,
    TIGHTEST_RADIUS,
    Route,
    Speeds,
    load_road_network,
    make_lane_path,
)
from cns_drake.roads.car_outline import swept_area


def network_of(folder, *, kerb_radius=8.0, **style):
    """Roads "in", from the west, and "up" and "down" at its eastern end."""
    end = {"dead_end": True, "kerb_radius": kerb_radius}
    junctions = {
        "west": {"position": [0, 0], **end},
        "middle": {"position": [100, 0]},
        "north": {"position": [100, 80], **end},
        "south": {"position": [100, -80], **end},
    }
    roads = {
        "in": {"start": "west", "end": "middle"},
        "up": {"start": "middle", "end": "north", "via": [[105, 40, 60]]},
        "down": {"start": "middle", "end": "south"},
    }
    file = folder / "roads.yaml"
    content = {"defaults": style, "junctions": junctions, "roads": roads}
    file.write_text(yaml.safe_dump(content))
    return load_road_network(file)


def leg(road, direction="forward", lane=1, **ends):
    return {"road": road, "direction": direction, "lane": lane, **ends}


def drive(network, *legs, aside=0.0):
    route = Route.model_validate(list(legs))
    path = make_lane_path(network, route, POINT_SPACING, "d.yaml", aside=aside)
    return Trajectory(path, Speeds())


def driven(trajectory):
    """Returns (N, 2) places and (N,) curvatures of the driven curve."""
    t = np.linspace(0, trajectory.duration, 6000)
    moments = trajectory.at(t)
    return moments.jet.p[:, :2], moments.jet.turn / moments.jet.speed


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
