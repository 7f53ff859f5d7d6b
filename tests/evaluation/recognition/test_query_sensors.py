"""Queries are turned, tilted and partly hidden; places are as recorded."""

from dataclasses import replace

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.measured_pairs import place_outcome, values_of
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evaluation.base import InputError, poses
from evaluation.drives import QuerySensor, cloud_at, open_drive
from evaluation.methods import Method, MethodConfig, make_method
from evaluation.recognition import (
    PAPER_PROTOCOL,
    RANDOM_YAW_PROTOCOL,
    RetrievalProtocol,
    describe_drive,
    retrieve,
)

P_WL = np.random.default_rng(5).uniform(-30.0, 30.0, (200, 3))
TURNED = RetrievalProtocol(turn_queries=True, tilt_queries=20.0)


class Corresponding(Method):
    """Aligns points, each with that of the same number; ignores headings."""

    name = "corresponding"
    Config = MethodConfig

    def describe(self, points):
        return points

    def build_database(self, places):
        return places

    def score(self, query, database, *, exhaustive=False):
        ranges = [np.linalg.norm(one, axis=1) for one in (query, *database)]
        return np.array([-np.abs(one - ranges[0]).sum() for one in ranges[1:]])

    def relative_pose(self, query, database, place):
        means = database[place].mean(axis=0), query.mean(axis=0)
        R_PQ, _ = Rotation.align_vectors(
            database[place] - means[0], query - means[1]
        )
        return poses.make_pose(
            R_PQ.as_matrix(), means[0] - R_PQ.apply(means[1])
        )


def record(folder, ys):
    """Drives past the same landmarks, at other headings."""
    X_WBs = [yaw_pose(6.0 * k, y, 0.1, 0.3 + y) for k, y in enumerate(ys)]
    scans = [
        make_scan((P_WL - X[:3, 3]) @ X[:3, :3] - [0.0, 0.0, 1.6])
        for X in X_WBs
    ]
    return open_drive(write_recording(folder, scans, X_WBs))


@pytest.fixture(scope="module")
def drives(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drives")
    ys = np.zeros(7)
    return record(folder / "a", ys), record(folder / "b", ys + 0.7)


def test_poses_are_judged_against_the_turned_sensor(drives):
    plain, turned = (
        place_outcome(*drives, Corresponding(), protocol=protocol)
        for protocol in (RetrievalProtocol(), TURNED)
    )
    for found in (plain, turned):
        assert values_of(found, "pose")["pose_success"] == 1.0
        assert found.outcomes.columns["translation_error"].max() < 1e-4
        assert found.outcomes.columns["rotation_error_deg"].max() < 1e-4
    plain, turned = (
        retrieve(*drives, Corresponding(), protocol)
        for protocol in (RetrievalProtocol(), TURNED)
    )
    np.testing.assert_allclose(turned.scores, plain.scores, atol=1e-9)
    np.testing.assert_array_equal(turned.matches, plain.matches)


@pytest.mark.parametrize("number", [1, 3])
def test_a_turned_cloud_is_the_same_in_the_world(drives, number):
    drive = drives[1]
    (described,) = describe_drive(
        drive,
        [Corresponding()],
        {"places", "queries"},
        replace(TURNED, scans_per_place=number, query_spacing=5.0),
    )
    assert described.queries.frames.tolist() == described.places.frames.tolist()
    for place, query, X_WP, X_WQ in zip(
        described.places.descriptors,
        described.queries.descriptors,
        described.places.X_WS,
        described.queries.X_WS,
        strict=True,
    ):
        assert np.abs(place - query).max() > 1.0
        np.testing.assert_allclose(
            poses.transform(X_WQ, query),
            poses.transform(X_WP, place),
            atol=1e-9,
        )
    np.testing.assert_array_equal(
        described.places.X_WS, drive.X_WS[described.places.frames]
    )


class Cropping(MethodConfig):
    reach: float = 50.0


class Counting(Corresponding):
    """Keeps what it was asked to describe; another reach is another method."""

    name = "counting"
    Config = Cropping

    def __init__(self, *arguments, asked):
        super().__init__(*arguments)
        self.asked = asked

    def describe(self, points):
        self.asked.append(points)
        return points[np.linalg.norm(points, axis=1) < self.config.reach]


@pytest.mark.parametrize(
    ("reach", "protocol", "number"),
    [
        (50.0, RetrievalProtocol(), 0),
        (20.0, RetrievalProtocol(), 4),
        (50.0, RetrievalProtocol(half_extent=40.0), 4),
        (50.0, RetrievalProtocol(scans_per_place=2), 4),
        (50.0, replace(TURNED, seed=3), 4),
        # Frames that are no places.
        (50.0, RetrievalProtocol(query_spacing=5.0), 3),
    ],
)
def test_queries_of_a_second_protocol_are_places_of_the_first(
    drives, reach, protocol, number
):
    """A method describes a cloud once, whatever it is described for."""
    asked: list = []
    first = replace(TURNED, place_spacing=10.0, query_spacing=10.0)
    protocol = replace(protocol, place_spacing=10.0)
    methods = [
        Counting(Cropping(reach=one), asked=asked) for one in (50.0, reach)
    ]
    both = frozenset({"places", "queries"})
    further = [
        (methods[0], both, first),
        (methods[1], frozenset({"queries"}), protocol),
    ]
    one, two = describe_drive(drives[0], [], both, first, further=further)
    assert len(one.places.frames) == len(one.queries.frames) == 4
    assert len(asked) == 8 + number
    (alone,) = describe_drive(drives[0], [methods[1]], {"queries"}, protocol)
    assert two.queries.frames.tolist() == alone.queries.frames.tolist()
    for mine, other in zip(
        two.queries.descriptors, alone.queries.descriptors, strict=True
    ):
        np.testing.assert_array_equal(mine, other)
    assert list(two.places.descriptors) == []


def test_places_are_described_as_ever(drives):
    for protocol in (RetrievalProtocol(), replace(TURNED, hide_sector=90.0)):
        (one,) = describe_drive(
            drives[0], [Corresponding()], {"places", "queries"}, protocol
        )
        for frame, cloud in zip(
            one.places.frames, one.places.descriptors, strict=True
        ):
            np.testing.assert_array_equal(
                cloud, cloud_at(drives[0], int(frame), 1, 100.0)
            )
        changed = protocol.turn_queries
        assert changed is not np.array_equal(
            one.queries.descriptors[0], one.places.descriptors[0]
        )
    plain = RetrievalProtocol()
    assert TURNED.descriptor_options(queries=False) == plain.descriptor_options(
        queries=False
    )
    assert TURNED.descriptor_options() != plain.descriptor_options()
    assert (
        replace(plain, seed=3).descriptor_options()
        == plain.descriptor_options()
    )
    assert (
        replace(TURNED, seed=3).descriptor_options()
        != TURNED.descriptor_options()
    )


def test_points_are_cropped_where_the_turned_sensor_has_them(tmp_path):
    corner = np.array([[14.0, 14.0, 0.0], [14.0, 0.0, 0.0]])
    drive = open_drive(
        write_recording(tmp_path / "d", [make_scan(corner)], [np.eye(4)])
    )
    for yaw, kept in ((0.0, 2), (np.pi / 4, 1), (2.0 * np.pi, 2)):
        X_SQ = np.eye(4)
        X_SQ[:3, :3] = Rotation.from_euler("z", yaw).as_matrix()
        cloud = cloud_at(drive, 0, 1, 14.1, sensor=QuerySensor(X_SQ))
        assert len(cloud) == kept
    # After a whole turn all is as before.
    np.testing.assert_allclose(cloud, cloud_at(drive, 0, 1, 14.1), atol=1e-12)


def test_a_draw_depends_on_seed_and_frame_alone():
    one = QuerySensor.draw(4, 17, True, 0.0, 0.0)
    both = QuerySensor.draw(4, 17, True, 1.5, 60.0)
    yaws, rolls, pitches = [], [], []
    for frame in range(300):
        R = QuerySensor.draw(4, frame, True, 1.5, 0.0).X_SQ[:3, :3]
        yaw, pitch, roll = Rotation.from_matrix(R).as_euler("ZYX", degrees=True)
        yaws.append(yaw)
        pitches.append(pitch)
        rolls.append(roll)
    for values in (rolls, pitches):
        assert 1.4 < np.max(np.abs(values)) <= 1.5
    assert np.histogram(yaws, 4, (-180.0, 180.0))[0].min() > 50
    heading = both.X_SQ[:3, 0] / np.hypot(*both.X_SQ[:2, 0])
    np.testing.assert_allclose(heading[:2], one.X_SQ[:2, 0], atol=1e-12)
    other = QuerySensor.draw(5, 17, True, 0.0, 0.0)
    assert not np.allclose(one.X_SQ, other.X_SQ)
    still = QuerySensor.draw(4, 17, False, 0.0, 60.0)
    assert still.X_SQ is None
    assert still.hidden_from == both.hidden_from


def test_a_sector_is_hidden():
    azimuths = np.radians(np.arange(0.5, 360.0))
    scan = make_scan(
        np.stack([np.cos(azimuths), np.sin(azimuths), azimuths], axis=1)
    )
    assert QuerySensor().without_hidden(scan) is scan
    for frame in range(20):
        sensor = QuerySensor.draw(1, frame, False, 0.0, 90.0)
        kept = np.isin(scan["z"], sensor.without_hidden(scan)["z"])
        assert 269 <= kept.sum() <= 271
        # It is one sector: its two edges, all around.
        assert np.count_nonzero(kept != np.roll(kept, 1)) == 2
    nowhere = make_scan(np.full((1, 3), np.nan))
    assert len(sensor.without_hidden(nowhere)) == 1


def test_all_scans_of_a_query_lack_the_same_sector(drives):
    protocol = RetrievalProtocol(
        hide_sector=120.0, scans_per_place=3, query_spacing=18.0
    )
    (one,) = describe_drive(drives[0], [Corresponding()], {"queries"}, protocol)
    sensor = protocol.query_sensor(18 // 6)
    expected = sum(
        len(sensor.without_hidden(drives[0].scan(k))) for k in (2, 3, 4)
    )
    assert len(one.queries.descriptors[1]) == expected < 600


def test_nothing_hidden_nothing_tilted_changes_nothing(drives):
    plain = retrieve(*drives, Corresponding())
    zero = RetrievalProtocol(tilt_queries=0.0, hide_sector=0.0, seed=9)
    same = retrieve(*drives, Corresponding(), zero)
    np.testing.assert_array_equal(same.scores, plain.scores)
    assert zero.to_text() == RetrievalProtocol().to_text()
    text = replace(TURNED, hide_sector=45.0, seed=2).to_text()
    for part in ("random yaw", "up to 20 deg", "sector of 45 deg", "seed 2"):
        assert part in text


def test_overlaps_do_not_depend_on_the_heading(drives):
    protocol = RetrievalProtocol(overlap=0.3)
    turned = replace(protocol, turn_queries=True)
    plain, other = (
        retrieve(*drives, Corresponding(), one).overlaps
        for one in (protocol, turned)
    )
    np.testing.assert_allclose(other, plain, atol=1e-9)


def test_protocols_have_names():
    assert (RANDOM_YAW_PROTOCOL.name, PAPER_PROTOCOL.name) == (
        "random-yaw",
        "paper",
    )
    assert (
        replace(RANDOM_YAW_PROTOCOL, radius=7.5, verified=True).name
        == "random-yaw"
    )
    for changed in (
        {"radius": 12.0},
        {"query_spacing": 9.9},
        {"half_extent": 80.0},
        {"scans_per_place": 1},
        {"exclude_recent": 30.0},
        {"seed": 1},
    ):
        assert replace(RANDOM_YAW_PROTOCOL, **changed).name == "own", changed
    assert RetrievalProtocol().name == "recorded"
    assert RetrievalProtocol(hide_sector=30.0).name == "own"


@pytest.mark.parametrize("turn_deg", [90.0, 180.0, 270.0])
def test_turns_of_a_grid_change_nothing(turn_deg):
    """Scan Context ignores headings but for its grids' steps."""
    method = make_method("scan-context++", {})
    rng = np.random.default_rng(4)
    walls = rng.uniform([-40.0, -40.0, -1.5], [40.0, 40.0, 6.0], (4000, 3))
    walls[::2, 0] = np.round(walls[::2, 0] / 20.0) * 20.0 + 0.37
    places = [walls, np.add(walls, (3.0, -2.0, 0.0)), walls * (0.8, 1.1, 1.0)]
    database = method.build_database(
        [method.describe_batch([one], of_places=True)[0] for one in places]
    )
    # Quarters of a turn, to the last bit.
    c, s = (round(f(np.radians(turn_deg))) for f in (np.cos, np.sin))
    turned = walls @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    asked, expected = (
        method.score(
            method.describe_batch([one], of_places=False)[0],
            database,
            exhaustive=True,
        )
        for one in (turned, walls)
    )
    assert expected[0] > expected[2]
    np.testing.assert_allclose(asked, expected, rtol=0.0, atol=1e-9)


def test_a_turn_of_360_deg_is_none(drives, monkeypatch):
    once = retrieve(*drives, Corresponding(), RetrievalProtocol())

    R = Rotation.from_euler("z", 2.0 * np.pi)

    def whole(*arguments):
        return QuerySensor(poses.make_pose(R.as_matrix(), np.zeros(3)))

    monkeypatch.setattr(QuerySensor, "draw", whole)
    turning = RetrievalProtocol(turn_queries=True)
    again = retrieve(*drives, Corresponding(), turning)
    np.testing.assert_allclose(again.scores, once.scores, atol=1e-9)
    assert (again.matches == once.matches).all()


@pytest.mark.parametrize(
    ("values", "fault"),
    [
        ({"tilt_queries": -0.1}, "--tilt-queries: -0.1 is not from 0 to 90"),
        ({"tilt_queries": 90.1}, "--tilt-queries: 90.1"),
        ({"tilt_queries": np.nan}, "--tilt-queries: nan"),
        ({"hide_sector": 360.0}, "--hide-sector: 360.0 is not from 0 to below"),
        ({"hide_sector": -1.0}, "--hide-sector: -1.0"),
        ({"hide_sector": np.nan}, "--hide-sector: nan"),
        ({"seed": -1}, "--seed: -1 is negative"),
    ],
)
def test_values_out_of_range_are_refused(values, fault):
    with pytest.raises(InputError, match=fault):
        RetrievalProtocol(**values)
    assert RetrievalProtocol(tilt_queries=90.0, hide_sector=359.9).seed == 0
