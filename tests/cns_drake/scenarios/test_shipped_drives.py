"""The twelve drives: legal, smooth, in their lanes, and where they meet."""

from helpers.drives import (
    SPACING,
    shipped_drive,
    spatial_acceleration,
    spatial_velocity,
)
import numpy as np
import pytest
from scipy.spatial import cKDTree
from shapely import contains, distance, linestrings, points, polygons, prepare

from cns_drake.recording import FRAME_PERIOD, frames_within
from cns_drake.scenarios import count_frames, make_scenario, plan_drive
from evaluation.drives import sample_frames
from evaluation.recognition import PAPER_PROTOCOL
from worlds.maps import recordable_drives
from worlds.roads import RoadSurface, load_road_network

pytestmark = pytest.mark.slow

SHIPPED = sorted(recordable_drives())
# Queries of the later drive that have a match in the earlier one, from the
# paper's Table II (true positives over recall at 1).
QUERIES_WITH_MATCH = {
    ("riverside_01", "riverside_02"): 118,
    ("suburbia_01", "suburbia_02"): 142,
    ("downtown_03", "downtown_04"): 125,
    ("downtown_02", "downtown_04"): 141,
    ("downtown_01", "downtown_04"): 178,
    ("metropolis_03", "metropolis_04"): 162,
    ("metropolis_02", "metropolis_04"): 153,
    ("metropolis_01", "metropolis_04"): 147,
}


@pytest.fixture(scope="module")
def drives():
    return {name: shipped_drive(name) for name in SHIPPED}


def test_all_twelve_are_there():
    paired = {name for pair in QUERIES_WITH_MATCH for name in pair}
    assert paired == set(SHIPPED)
    assert len(SHIPPED) == 12


@pytest.mark.sampled(4)
@pytest.mark.parametrize("name", SHIPPED)
def test_it_starts_and_ends_at_rest(drives, name):
    _, path, trajectory = drives[name]
    for t, point in ((0.0, 0), (trajectory.duration, -1)):
        np.testing.assert_allclose(
            trajectory.pose(t).translation(), path.points[point], atol=1e-9
        )
        for twist in (
            spatial_velocity(trajectory, t),
            spatial_acceleration(trajectory, t),
        ):
            np.testing.assert_allclose(
                twist.get_coeffs(), np.zeros(6), atol=1e-9
            )


@pytest.mark.sampled(4)
@pytest.mark.parametrize("name", SHIPPED)
def test_bounds_hold_at_every_instant(drives, name):
    scenario, path, trajectory = drives[name]
    t = np.arange(0.0, trajectory.duration, 0.005)
    u, rate, acceleration = trajectory.path_parameter(t)
    jet = trajectory.path.evaluate(u)
    v = jet.dp * rate[:, None]
    a = jet.ddp * rate[:, None] ** 2 + jet.dp * acceleration[:, None]
    tangent = jet.dp / np.linalg.norm(jet.dp, axis=1, keepdims=True)
    speed = np.linalg.norm(v, axis=1)
    along = np.sum(a * tangent, axis=1)
    across = np.linalg.norm(a - along[:, None] * tangent, axis=1)

    speeds = scenario.speeds
    assert speed.max() <= speeds.cruise + 1e-9
    assert np.abs(along).max() <= speeds.longitudinal_acceleration
    assert across.max() <= speeds.lateral_acceleration
    # The drives reach these limits.
    assert speed.max() > 0.99 * speeds.cruise
    assert np.abs(along).max() > 0.9 * speeds.longitudinal_acceleration
    assert across.max() > 0.99 * speeds.lateral_acceleration
    limits = np.interp(
        u, path.spacing * np.arange(len(path.points)), path.speed_limits
    )
    assert np.all(speed <= limits + 1e-9)


@pytest.mark.sampled(4)
@pytest.mark.parametrize("name", SHIPPED)
def test_acceleration_is_continuous(drives, name):
    _, _, trajectory = drives[name]
    # Across every knot of the time scaling, and of the path, where a step
    # would be: the jerk of at most 50 m/s^3 moves it by 1e-5.
    step = 1e-7
    time_knots = np.arange(0.3, trajectory.duration, 0.3)
    t = np.linspace(0, trajectory.duration, 20001)
    u = trajectory.path_parameter(t)[0]
    rising = np.concatenate([[True], np.diff(u) > 1e-9])
    path_knots = np.arange(1, round(trajectory.path.end / SPACING))
    path_times = np.interp(
        path_knots * trajectory.path.spacing, u[rising], t[rising]
    )
    for knots in (time_knots, path_times):
        before, after = (
            _accelerations(trajectory, knots + k) for k in (-step, step)
        )
        assert np.abs(after - before).max() < 1e-5


def _accelerations(trajectory, t):
    """Returns (N, 5): of the origin, of the yaw and of the pitch."""
    u, rate, acceleration = trajectory.path_parameter(t)
    jet = trajectory.path.evaluate(u)
    return np.column_stack(
        [
            jet.ddp * rate[:, None] ** 2 + jet.dp * acceleration[:, None],
            jet.ddyaw * rate**2 + jet.dyaw * acceleration,
            jet.ddclimb * rate**2 + jet.dclimb * acceleration,
        ]
    )


@pytest.mark.sampled(4)
@pytest.mark.parametrize("name", SHIPPED)
def test_the_vehicle_stays_in_its_lane(drives, name):
    scenario, path, trajectory = drives[name]
    t = np.arange(0.0, trajectory.duration, 0.1)
    jet = trajectory.path.evaluate(trajectory.path_parameter(t)[0])
    # In the tightest turns the wheel cannot be turned at once.
    lane = linestrings(path.points[:, :2])
    assert distance(lane, points(jet.p[:, :2])).max() < 0.15
    # The whole body, 4.7 m by 1.9 m, stays off the kerbs.
    body = np.array([(3.7, 0.95), (3.7, -0.95), (-1, -0.95), (-1, 0.95)])
    ahead = np.stack([np.cos(jet.yaw), np.sin(jet.yaw)], axis=1)
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    corners = jet.p[:, None, :2] + (
        body[None, :, :1] * ahead[:, None] + body[None, :, 1:] * left[:, None]
    )
    area = load_road_network(scenario.folder.roads).areas.lane_area
    prepare(area)
    assert contains(area, polygons(corners)).all()


@pytest.mark.sampled(4)
@pytest.mark.parametrize("name", SHIPPED)
def test_the_vehicle_follows_the_road_up_and_down(drives, name):
    scenario, _, trajectory = drives[name]
    surface = RoadSurface(load_road_network(scenario.folder.roads))
    t = np.arange(0.0, trajectory.duration, 0.02)
    jet = trajectory.path.evaluate(trajectory.path_parameter(t)[0])
    off = jet.p[:, 2] - surface.heights(jet.p[:, :2])
    assert np.abs(off).max() < 0.08
    # No kink: 0.02 s are at most 0.3 m.
    assert np.abs(np.diff(jet.climb)).max() < np.radians(1.2)
    assert np.abs(np.diff(jet.climb, 2)).max() < np.radians(0.1)
    climbed = np.ptp(jet.p[:, 2])
    if name.startswith("downtown"):
        assert climbed > 7.9
        assert 0.18 < np.tan(np.abs(jet.climb).max()) < 0.27
    else:
        assert climbed < 1e-9


def test_drives_are_brisk_and_not_too_long(drives):
    total = 0.0
    for _, _, trajectory in drives.values():
        assert 1250 < trajectory.length < 3500
        assert 8.0 < trajectory.length / trajectory.duration < 12.0
        total += trajectory.duration
    assert total < 32 * 60


def test_plans_are_the_drives(drives):
    scenario, _, trajectory = drives["downtown_04"]
    planned = plan_drive(scenario)
    assert planned.duration == trajectory.duration
    for t in (0.0, 50.0, planned.duration):
        np.testing.assert_array_equal(
            planned.pose(t).GetAsMatrix34(), trajectory.pose(t).GetAsMatrix34()
        )


def test_facts_are_those_of_the_drive(drives):
    scenario, _, trajectory = drives["suburbia_02"]
    planned = plan_drive(scenario)
    assert planned.length == trajectory.length
    assert planned.duration == trajectory.duration
    frames = count_frames(scenario, planned)
    assert frames == frames_within(trajectory.duration)
    # The last frame is within the drive, one more would not be.
    assert (frames - 1) * FRAME_PERIOD <= planned.duration
    assert frames * FRAME_PERIOD > planned.duration
    values = scenario.model_dump() | {"frames": 30}
    assert count_frames(make_scenario(values, "test"), planned) == 30


@pytest.fixture(scope="module")
def frames(drives):
    """The LiDAR's position and the vehicle's heading in each frame."""
    result = {}
    for name, (scenario, _, trajectory) in drives.items():
        t = FRAME_PERIOD * np.arange(frames_within(trajectory.duration))
        jet = trajectory.path.evaluate(trajectory.path_parameter(t)[0])
        up = np.stack(
            [
                -np.sin(jet.climb) * np.cos(jet.yaw),
                -np.sin(jet.climb) * np.sin(jet.yaw),
                np.cos(jet.climb),
            ],
            axis=1,
        )
        height = scenario.lidars["lidar"].xyz[2]
        result[name] = jet.p + height * up, jet.yaw
    return result


def _meeting(frames, database, query):
    """Returns distance and turn from each query to its nearest place."""
    positions, headings = frames[database]
    places = sample_frames(positions, PAPER_PROTOCOL.place_spacing)
    asked, heading = frames[query]
    queries = sample_frames(asked, PAPER_PROTOCOL.query_spacing)
    tree = cKDTree(positions[places])
    distances, nearest = tree.query(asked[queries])
    turns = heading[queries] - headings[places[nearest]]
    return distances, np.abs((turns + np.pi) % (2 * np.pi) - np.pi)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("pair", QUERIES_WITH_MATCH)
def test_pairs_meet_as_often_as_the_papers(frames, pair):
    distances, turns = _meeting(frames, *pair)
    matched = distances <= PAPER_PROTOCOL.radius
    wanted = QUERIES_WITH_MATCH[pair]
    assert np.count_nonzero(matched) == pytest.approx(wanted, rel=0.1)
    # The drives overlap in part only.
    assert 0.6 < matched.mean() < 0.98
    # Some places are passed in the same direction, some in the opposite.
    assert np.count_nonzero(turns[matched] < np.radians(20)) >= 12
    assert np.count_nonzero(turns[matched] > np.radians(160)) >= 12


@pytest.mark.sampled(3)
@pytest.mark.parametrize("pair", QUERIES_WITH_MATCH)
def test_pairs_see_nearly_the_same_streets(drives, frames, pair):
    # Structures that only one drive sees would count as change.
    network = load_road_network(drives[pair[0]][0].folder.roads)
    places = np.concatenate(
        [
            road.evaluate(np.arange(0.5, road.full_length))[:, :2]
            for road in network.roads.values()
        ]
    )
    visited = [
        cKDTree(frames[name][0][:, :2]).query(places)[0] < 9.0 for name in pair
    ]
    both, either = visited[0] & visited[1], visited[0] | visited[1]
    assert both.sum() / either.sum() > 0.8
