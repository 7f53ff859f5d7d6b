"""Routes: lanes in order, legal turns, lane changes, faults."""

import numpy as np
from pydantic import ValidationError
import pytest
from scipy.spatial import cKDTree

from evaluation.base import InputError
from worlds.maps import worlds_folder
from worlds.roads import load_road_network, make_lane_path
from worlds.shapes import Route

# From the middle of a car to the kerb, at least [m].
CAR_ROOM = 1.4


@pytest.fixture(scope="module")
def network():
    return load_road_network(worlds_folder() / "metropolis" / "roads.yaml")


def leg(road, direction="forward", lane=1, **ends):
    return {"road": road, "direction": direction, "lane": lane, **ends}


def path_of(network, *legs, spacing=0.5, aside=0.0):
    route = Route.model_validate(list(legs))
    return make_lane_path(network, route, spacing, "drive.yaml", aside=aside)


def test_points_follow_the_lanes_and_are_even(network):
    path = path_of(
        network,
        leg("avenue_south", "backward", 2),
        leg("avenue_middle", "backward", 2),
    )
    steps = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    np.testing.assert_allclose(steps, path.spacing, rtol=1e-3)
    assert path.spacing == pytest.approx(0.5, rel=0.01)

    # Northbound, on the outer one of two 3.5 m lanes: 5.25 m to the right.
    south = network.roads["avenue_south"].lane_centreline("backward", 2)
    middle = network.roads["avenue_middle"].lane_centreline("backward", 2)
    np.testing.assert_allclose(path.points[0], south[0], atol=1e-9)
    np.testing.assert_allclose(path.points[-1], middle[-1], atol=1e-9)
    road = network.roads["avenue_south"]
    centre = road.evaluate([road.last_station])[0, :3]
    np.testing.assert_allclose(path.points[0] - centre, [5.25, 0, 0], atol=0.02)


def lateral(network, road, direction, lane, aside):
    """Distances to the right of the road's middle line along a road [m]."""
    path = path_of(network, leg(road, direction, lane), aside=aside).points
    middle = network.roads[road]
    centre = middle.evaluate(middle.stations(0.1))[:, :3]
    centre = centre if direction == "forward" else centre[::-1]
    nearest = cKDTree(centre).query(path)[1]
    along = np.gradient(centre[:, :2], axis=0)[nearest]
    off = path[:, :2] - centre[nearest, :2]
    right = along[:, 1] * off[:, 0] - along[:, 0] * off[:, 1]
    return right / np.linalg.norm(along, axis=1)


# Lanes of 3.5 m; the boulevard has a median of 4.5 m.
@pytest.mark.parametrize("direction", ["forward", "backward"])
@pytest.mark.parametrize(
    ("road", "lane", "aside", "expected"),
    [
        ("ring_north_east", 2, -1.5, 3.75),
        ("ring_north_east", 2, 0.3, 5.55),
        # The car moves over as far as it has room.
        ("ring_north_east", 2, 1.0, 7.0 - CAR_ROOM),
        ("ring_north_east", 1, -2.5, -0.75),
        ("boulevard_middle", 1, -1.0, 2.25 + CAR_ROOM),
        ("inner_street_west", 1, -3.0, -1.25),
    ],
)
def test_aside_between_junctions(
    network, direction, road, lane, aside, expected
):
    right = lateral(network, road, direction, lane, aside)
    middle = slice(len(right) // 2 - 5, len(right) // 2 + 5)
    np.testing.assert_allclose(right[middle], expected, atol=0.03)
    # At the junctions it is in its lane.
    usual = lateral(network, road, direction, lane, 0.0)
    np.testing.assert_allclose(right[[0, -1]], usual[[0, -1]], atol=0.03)


def test_start_and_end_are_measured_from_the_entry(network):
    whole = path_of(network, leg("ring_north_east", lane=1))
    part = path_of(network, leg("ring_north_east", lane=1, start=20, end=90))
    # The lane bends less than the centreline nowhere before 90 m.
    np.testing.assert_allclose(part.points[0], whole.points[40], atol=0.02)
    assert part.length == pytest.approx(70, abs=0.1)
    back = path_of(
        network, leg("ring_north_east", "backward", 1, start=20, end=90)
    )
    road = network.roads["ring_north_east"]
    expected = road.evaluate(
        [road.last_station - 20], road.lane_offset("backward", 1)
    )
    np.testing.assert_allclose(back.points[0], expected[0, :3], atol=1e-9)


def test_a_lane_change_is_smooth_and_complete(network):
    path = path_of(network, leg("boulevard_middle", "forward", [1, 2]))
    road = network.roads["boulevard_middle"]
    y_first = road.lane_centreline("forward", 1)[0, 1]
    y_last = road.lane_centreline("forward", 2)[-1, 1]
    offset = (path.points[:, 1] - y_first) / (y_last - y_first)
    assert offset[0] == pytest.approx(0, abs=1e-9)
    assert offset[-1] == pytest.approx(1, abs=1e-9)
    assert np.all(np.diff(offset) > -2e-3)
    # The quintic's greatest slope is 15/8 of its mean over 50 m.
    slope = np.diff(offset) / np.diff(path.points[:, 0])
    assert slope.max() == pytest.approx(15 / 8 / 50, rel=0.02)


def test_speed_limits_change_with_the_road_and_are_lower_between(network):
    path = path_of(
        network,
        leg("ring_south_west", "forward", 2, start=80),
        leg("ring_north_west", "forward", 2),
        leg("ring_north_east", "forward", 2, end=30),
    )
    # 50 mph on both western roads and the junction between them; 40 mph
    # from the northern junction on.
    assert set(path.speed_limits) == {22.4, 17.9}
    change = np.flatnonzero(np.diff(path.speed_limits))
    assert len(change) == 1
    road = network.roads["ring_north_west"]
    north = road.evaluate([road.last_station])[0, :3]
    distance = np.linalg.norm(path.points[change[0]] - north)
    assert distance == pytest.approx(5.25, abs=0.5)


FAULTS = {
    "no such road": (
        [leg("main_street")],
        r"route\.0 \(main_street forward\): no road 'main_street'",
    ),
    "no such lane": (
        [leg("connector", lane=2)],
        r"route\.0 .*has 1 lane\(s\) forward, no lane 2",
    ),
    "legs apart": (
        [leg("ring_east"), leg("avenue_north")],
        r"route\.1 \(avenue_north forward\): road ring_east forward ends at "
        r"inner_east, road avenue_north forward starts at north",
    ),
    "wrong way round": (
        [leg("ring_east"), leg("ring_south_east", "backward")],
        r"route\.1 .*ends at inner_east, .* starts at south",
    ),
    "U-turn": (
        [
            leg("inner_street_west", end=20),
            leg("inner_street_west", "backward"),
        ],
        r"route\.0 .*no room for turning round: the car needs a disc 13\.2 m",
    ),
    "left from the right lane": (
        [
            leg("boulevard_west", "backward", 2),
            leg("ring_south_west", "backward", 1),
        ],
        r"route\.1 .*from lane 2 of boulevard_west to lane 1: a left turn",
    ),
    "right from the left lane": (
        [leg("boulevard_west", "backward"), leg("ring_north_west")],
        r"route\.1 .*from lane 1 .*: a right turn",
    ),
    "lane change in a junction": (
        [leg("ring_east"), leg("ring_south_east", lane=2)],
        r"route\.1 .*from lane 1 .* to lane 2: straight on keeps the lane",
    ),
    "no room for a lane change": (
        [leg("ring_east", lane=[1, 2])],
        r"route\.0 .*too short for a lane change, which needs 20 m",
    ),
    "beyond the end": (
        [leg("ring_east", start=3, end=40)],
        r"route\.0 .*from 3 m to 40 m does not lie within the road's 12",
    ),
    "backwards": (
        [leg("ring_south_east", start=50, end=40)],
        r"route\.0 .*from 50 m to 40 m",
    ),
    "start in the middle": (
        [leg("ring_east"), leg("ring_south_east", start=3)],
        r"route\.1 .*start is allowed in the first leg only",
    ),
    "end in the middle": (
        [leg("ring_east", end=3), leg("ring_south_east")],
        r"route\.0 .*end is allowed in the last leg only, or",
    ),
    "too short": (
        [leg("ring_south_east", start=10, end=29)],
        r"route: 1\d\.\d m long; a drive needs at least 20 m",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_name_the_leg(network, fault):
    legs, message = FAULTS[fault]
    with pytest.raises(InputError, match="drive.yaml: " + message) as error:
        path_of(network, *legs)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "legs",
    [
        [],
        [{"road": "ring_east", "lane": 1}],
        [leg("ring_east", "sideways")],
        [leg("ring_east", lane=0)],
        [leg("ring_east", lane="1")],
        [leg("ring_east", lane=[1, 2, 1])],
        [leg("ring_east", start=-1.0)],
        [leg("ring_east", speed=3.0)],
    ],
)
def test_malformed_legs_are_refused(legs):
    with pytest.raises(ValidationError):
        Route.model_validate(legs)
