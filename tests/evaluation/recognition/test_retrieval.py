from dataclasses import replace
import time

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.measured_pairs import place_outcome, values_of
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import cloud_at, open_drive, sample_frames, within_cube
from evaluation.methods import Method, MethodConfig, make_method
from evaluation.recognition import (
    DescribedScans,
    DescribingCost,
    PlaceOutcome,
    PoseErrors,
    QueryDrive,
    Retrieval,
    RetrievalProtocol,
    Search,
    compare_at_radii,
    describe_drive,
    joined_scans,
    retrieve,
)


def line(xs):
    return np.array([[x, 0.0, 0.0] for x in xs])


def test_frames_along_a_line():
    positions = line(np.arange(0.0, 40.0, 2.0))
    assert sample_frames(positions, 10.0).tolist() == [0, 5, 10, 15]
    assert sample_frames(positions, 5.0).tolist() == [
        0,
        3,
        5,
        8,
        10,
        13,
        15,
        18,
    ]


def test_length_counts_along_the_path_not_across():
    # The route is a square of 10 m: before a corner's second visit lie 40 m.
    corners = np.array([[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]])
    positions = np.concatenate([corners, corners]).astype(float)
    assert sample_frames(positions, 20.0).tolist() == [0, 2, 4, 6]
    # Distances are in three dimensions.
    steep = np.array([[0, 0, 3.0 * i] for i in range(8)])
    assert sample_frames(steep, 10.0).tolist() == [0, 4, 7]


def test_standing_and_jumping():
    positions = line([0.0, 0.0, 0.0, 9.0, 9.0, 35.0, 36.0, 41.0])
    assert sample_frames(positions, 10.0).tolist() == [0, 5, 7]
    assert sample_frames(positions[:1], 10.0).tolist() == [0]


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.05])
def test_jitter_is_no_travel(noise):
    """A car at 5 m/s stands for a minute, creeps, and goes on, at 10 Hz."""
    speeds = np.repeat([5.0, 0.0, 0.5, 5.0], [80, 600, 200, 90])
    x = np.cumsum(0.1 * speeds)
    rng = np.random.default_rng(3)
    positions = line(x) + rng.normal(0.0, noise, (len(x), 3))
    frames = sample_frames(positions, 10.0)
    # The first frame is at 0.5 m; a step is 0.5 m.
    wanted = np.arange(0.5, 95.0, 10.0)
    np.testing.assert_allclose(x[frames], wanted, atol=0.5 + 20.0 * noise)


def test_crop_is_a_box_with_its_faces():
    points = np.array(
        [
            [100.0, -100.0, 100.0],
            [100.001, 0.0, 0.0],
            [0.0, -100.001, 0.0],
            [0.0, 0.0, 100.001],
            [np.nan, 0.0, 0.0],
            [1.0, 2.0, 3.0],
        ]
    )
    kept = within_cube(points, 100.0)
    assert np.flatnonzero(kept).tolist() == [0, 5]
    assert within_cube(points, 2.0).sum() == 0
    assert within_cube(points, 3.0).sum() == 1


class OddOneOut(Method):
    """Compares the mean of clouds; leaves the last place out."""

    name = "odd"
    Config = MethodConfig

    def describe(self, points):
        return points.mean(axis=0)

    def build_database(self, places):
        return np.array(places)

    def score(self, query, database, *, exhaustive=False):
        scores = -np.linalg.norm(database - query, axis=1)
        if not exhaustive:
            scores[-1] = np.nan
        return scores


def record_line(folder, xs, **options):
    """Drives along x; the scan at x shows one point at height x."""
    scans = [make_scan(np.array([[5.0, 0.0, float(x)]])) for x in xs]
    X_WBs = [yaw_pose(x, 0.0, 0.0, 0.0) for x in xs]
    return open_drive(write_recording(folder, scans, X_WBs, **options))


def test_retrieval_from_two_drives(tmp_path):
    database = record_line(tmp_path / "a", np.arange(0.0, 31.0, 2.5))
    query = record_line(tmp_path / "b", np.arange(3.0, 44.0, 5.0))
    result = retrieve(database, query, OddOneOut())
    assert result.database_frames.tolist() == [0, 2, 4, 6, 8, 10, 12]
    assert result.query_frames.tolist() == [0, 2, 4, 6, 8]
    places = np.arange(0.0, 31.0, 5.0)
    queries = np.arange(3.0, 44.0, 10.0)
    np.testing.assert_allclose(
        result.distances, np.abs(queries[:, None] - places)
    )
    # The limit is 7.5 m: 33 m is 8 m from the last but one place.
    assert result.matches.sum(axis=1).tolist() == [3, 3, 3, 1, 0]
    np.testing.assert_allclose(
        result.scores[:, :-1],
        -np.abs(queries[:, None] - places[:-1]),
        atol=1e-5,
    )
    assert np.isnan(result.scores[:, -1]).all()


def test_no_candidate_has_no_pose_error(tmp_path):
    class Posed(OddOneOut):
        def relative_pose(self, query, database, place):
            return np.eye(4)

    database = record_line(tmp_path / "a", [0.0, 5.0])
    query = record_line(tmp_path / "b", [0.0, 11.0])
    found = retrieve(database, query, Posed()).pose_errors.translation
    np.testing.assert_allclose(found, [0.0, 11.0])
    # Its only place is the last one.
    alone = record_line(tmp_path / "c", [0.0])
    found = retrieve(alone, query, Posed()).pose_errors
    assert np.isnan([found.translation, found.rotation_deg]).all()


def test_match_radius_is_inclusive(tmp_path):
    database = record_line(tmp_path / "a", [0.0])
    for x, is_match in ((7.5, True), (7.5 + 1e-6, False)):
        query = record_line(tmp_path / f"q{x}", [x])
        result = retrieve(database, query, OddOneOut())
        assert result.matches.tolist() == [[is_match]]


def test_merged_scans_are_in_the_frame_of_the_place(tmp_path):
    # A post at (20, 4, 1) in the world, seen from a turning car.
    post = np.array([20.0, 4.0, 1.0])
    X_WBs = [yaw_pose(2.0 * i, 0.5 * i, 0.0, 0.4 * i) for i in range(5)]
    scans = [
        make_scan(((post - X[:3, 3]) @ X[:3, :3])[None] - [[0.0, 0.0, 1.6]])
        for X in X_WBs
    ]
    drive = open_drive(write_recording(tmp_path / "s", scans, X_WBs))
    # The frame, its scans, those of them before it, and those there are.
    for frame, number, before, there in (
        (0, 1, 0, 1),
        (1, 3, 0, 3),
        (3, 2, 0, 2),
        (3, 9, 0, 2),
        (2, 4, 2, 4),
        (1, 4, 2, 3),
        (4, 6, 3, 4),
    ):
        cloud = cloud_at(drive, frame, number, 100.0, (), before)
        assert len(cloud) == there
        expected = (post - X_WBs[frame][:3, 3]) @ X_WBs[frame][:3, :3]
        expected -= [0.0, 0.0, 1.6]
        np.testing.assert_allclose(
            cloud, np.tile(expected, (len(cloud), 1)), atol=1e-5
        )


def test_the_middle_or_the_first_scan_stands_for_a_place(tmp_path):
    X_WBs = [yaw_pose(5.0 * i, 0.0, 0.0, 0.0) for i in range(9)]
    scans = [make_scan(np.array([[10.0, 0.0, 0.0]]))] * 9
    drive = open_drive(write_recording(tmp_path / "s", scans, X_WBs))
    seen = []

    class Merging(OddOneOut):
        scans_per_place = 4

        def describe(self, points):
            seen.append(len(points))
            return super().describe(points)

    protocol = RetrievalProtocol(query_spacing=20.0)
    first = MethodConfig(place="first")
    for merging, sizes in (
        (Merging(), [2, 4, 3]),
        (Merging(first), [4, 4, 1]),
    ):
        seen.clear()
        (described,) = describe_drive(drive, [merging], {"queries"}, protocol)
        assert described.queries.frames.tolist() == [0, 4, 8]
        assert seen == sizes
    # The method's own choice comes before that of the protocol.
    paper = replace(protocol, place="first")
    assert paper.scans_before(Merging()) == 0
    assert paper.scans_before(Merging(MethodConfig(place="middle"))) == 2


def test_the_cost_of_descriptors(tmp_path, monkeypatch):
    """By a clock that only the method moves; the first cloud is slow."""
    spent = []
    monkeypatch.setattr(time, "process_time_ns", lambda: int(1e9 * sum(spent)))
    times = iter([100.0, 1.0, 2.0, 3.0, 5.0])

    class Slow(OddOneOut):
        def describe(self, points):
            spent.append(next(times))
            return super().describe(points)

    drive = record_line(tmp_path / "a", np.arange(0.0, 41.0, 10.0))
    protocol = RetrievalProtocol()
    costs = []
    # The queries are known, as the places are the same.
    further = [(Slow(), {"queries"}, protocol)]
    describe_drive(
        drive, [Slow()], {"places"}, protocol, further=further, costs=costs
    )
    assert costs == [DescribingCost(scans=1, points=1.0, time=2.5)] * 2


def test_metrics_of_a_pair(tmp_path):
    database = record_line(tmp_path / "a", np.arange(0.0, 31.0, 2.5))
    query = record_line(tmp_path / "b", np.arange(3.0, 44.0, 5.0))
    result = place_outcome(database, query, OddOneOut())
    values = values_of(result)
    # The query at 43 m has no match; that at 33 m has only the omitted place.
    assert values["queries"] == 5
    assert values["with_match"] == 4
    assert values["true_positives"] == 3
    assert values["f1_max_true_positives"] == 3
    # These three, and the one that is missed.
    assert values["f1_max_counted"] == 4
    assert values["r1"] == pytest.approx(3 / 4)
    assert values["places"] == 7
    assert (result.database, result.query) == ("a", "b")
    filtered = values_of(result, mode="filtered")
    assert filtered["f1_max"] == pytest.approx(2 * 0.75 / 1.75)
    # The number of all queries is no metric of the curve.
    assert filtered["queries"] == 5


def test_auc_over_the_radius(tmp_path):
    database = record_line(tmp_path / "a", np.arange(0.0, 31.0, 2.5))
    query = record_line(tmp_path / "b", np.arange(3.0, 44.0, 5.0))
    result = place_outcome(database, query, OddOneOut())
    found = values_of(result)
    assert found["auc_7.5m"] == found["auc"]
    radii = (2.5, 5.0, 7.5, 10.0, 15.0, 20.0, 25.0)
    for radius in radii:
        protocol = RetrievalProtocol(radius=radius)
        other = place_outcome(database, query, OddOneOut(), protocol=protocol)
        assert found[f"auc_{radius:g}m"] == values_of(other)["auc"]
    assert len({found[f"auc_{radius:g}m"] for radius in radii}) > 2


def test_database_far_from_every_query(tmp_path):
    database = record_line(tmp_path / "a", [0.0, 5.0])
    query = record_line(tmp_path / "b", [60.0, 70.0])
    with pytest.raises(InputError, match=r"b: no query lies within 7.5 m .*55"):
        place_outcome(database, query, OddOneOut())


def test_a_drive_that_saw_nothing(tmp_path):
    poses = [yaw_pose(20.0 * i, 0.0, 0.0, 0.0) for i in range(3)]
    far = np.array([[300.0, 0.0, 0.0]])
    write_recording(tmp_path / "blind", [make_scan(far)] * 3, poses)
    blind = open_drive(tmp_path / "blind")
    with pytest.raises(InputError, match=r"blind: no finite point .* 3 scans"):
        retrieve(blind, blind, make_method("solid", {}))


def test_batches_of_queries_give_the_same_as_all_at_once(tmp_path, monkeypatch):
    database = record_line(tmp_path / "a", np.arange(0.0, 31.0, 2.5))
    query = record_line(tmp_path / "b", np.arange(3.0, 84.0, 5.0))
    method, protocol = OddOneOut(), RetrievalProtocol(radius=8.0)
    (places,) = describe_drive(database, [method], {"places"}, protocol)
    (queries,) = describe_drive(query, [method], {"queries"}, protocol)
    num_queries, num_places = len(queries.queries.frames), 7
    found = []
    # All pairs; those of two queries; less than those of one.
    for most_pairs, sizes in (
        (num_queries * num_places, [num_queries]),
        (2 * num_places + 3, [2] * (num_queries // 2) + [1]),
        (num_places - 1, [1] * num_queries),
    ):
        outcomes = []
        monkeypatch.setattr(
            "evaluation.recognition.retrieval._MOST_PAIRS", most_pairs
        )
        batches = compare_at_radii(
            Search(method, places.places), places, queries, protocol, [None]
        )
        for rows, (one,) in batches:
            asked = queries.queries.chosen(np.array(rows))
            drive = QueryDrive("b", asked.stamps_ns, asked.p_WSs)
            outcomes.append(
                PlaceOutcome.of(
                    "odd", method, protocol, one, drive, ["a"] * num_places
                )
            )
        assert [len(one.outcomes) for one in outcomes] == sizes
        found.append(PlaceOutcome.joined(outcomes))
    assert found[0].outcomes.is_right.any()
    for one in found[1:]:
        assert repr([*one.numbers()]) == repr([*found[0].numbers()])
        columns = one.outcomes.columns
        assert columns.keys() == found[0].outcomes.columns.keys()
        for name, column in found[0].outcomes.columns.items():
            np.testing.assert_array_equal(columns[name], column)
        for name in ("best_places", "best_scores", "matches"):
            np.testing.assert_array_equal(
                getattr(one, name), getattr(found[0], name)
            )


def test_different_worlds(tmp_path):
    database = record_line(tmp_path / "a", [0.0, 5.0])
    query = record_line(tmp_path / "b", [0.0, 5.0], world_frame="utm")
    for compare in (retrieve, place_outcome):
        with pytest.raises(InputError, match="frame 'utm'"):
            compare(database, query, OddOneOut())


def test_the_best_place_has_a_frame_and_a_distance():
    nan = np.nan
    scores = np.array([[0.1, 0.5], [0.7, 0.7], [nan, nan]])
    found = Retrieval(
        query_frames=np.array([0, 4, 8]),
        database_frames=np.array([3, 6]),
        scores=scores,
        distances=np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]),
        matches=np.zeros((3, 2), dtype=bool),
        pose_errors=PoseErrors.unknown(3),
        is_known=np.ones((3, 2), dtype=bool),
    )
    # The first of equal ones is the best.
    assert found.best_frames.tolist() == [6, 3, -1]
    np.testing.assert_array_equal(found.best_distances, [2.0, 3.0, nan])


def test_joined_scans_of_other_worlds_lie_far_away():
    one, other = (
        DescribedScans(
            frames=np.arange(number),
            stamps_ns=np.arange(number),
            X_WS=np.tile(np.eye(4), (number, 1, 1)),
            descriptors=[name] * number,
        )
        for name, number in (("a", 2), ("b", 3))
    )
    joined = joined_scans([one, other, one], [0, 2, 0], most=6)
    assert joined.descriptors == ["a", "a", "b", "b", "b", "a"]
    assert joined.p_WSs[:, 0].tolist() == [0.0, 0.0, 2e5, 2e5, 2e5, 0.0]
    assert joined.frames.tolist() == [0, 1, 0, 1, 2, 0]
    assert not other.p_WSs.any()
