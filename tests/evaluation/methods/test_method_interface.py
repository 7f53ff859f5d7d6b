"""Inputs of methods beyond the coordinates of one scan."""

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.measured_pairs import place_outcome
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import open_drive
from evaluation.methods import (
    Method,
    MethodConfig,
    make_method,
    shipped_methods,
)
from evaluation.recognition import retrieve, write_scores


def record(folder, heights, y=0.0):
    """Drives along x, 10 m a frame; a scan shows a point at height x."""
    scans = [
        make_scan(np.array([[5.0, 0.0, height], [9.0, 1.0, 0.0]]))
        for height in heights
    ]
    X_WBs = [yaw_pose(10.0 * i, y, 0.0, 0.0) for i in range(len(heights))]
    return open_drive(write_recording(folder, scans, X_WBs))


class Highest(Method):
    """Compares heights."""

    name = "highest"
    Config = MethodConfig

    def describe(self, points):
        return float(points[:, 2].max())

    def build_database(self, places):
        return np.array(places)

    def score(self, query, database, *, exhaustive=False):
        return -np.abs(database - query)


@pytest.fixture
def drives(tmp_path):
    return (
        record(tmp_path / "a", [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
        record(tmp_path / "b", [1.1, 2.1, 3.1, 4.1, 5.1, 6.1], y=1.0),
    )


def test_all_fields_of_the_points(drives):
    class Rings(Highest):
        point_fields = ("intensity", "ring")

        def describe(self, points):
            assert points.dtype.names == ("x", "y", "z", "intensity", "ring")
            assert points["z"].dtype == np.float64
            assert points["ring"].dtype == np.uint16
            return float(points["z"].max() + 100.0 * points["ring"].max())

    plain = retrieve(*drives, Highest()).scores
    np.testing.assert_allclose(retrieve(*drives, Rings()).scores, plain)


def test_fields_of_merged_scans_stay_with_their_points(drives):
    class Merged(Highest):
        scans_per_place = 2
        point_fields = ("t",)

        def describe(self, points):
            # The scan before was taken 10 m farther back.
            assert points["x"].tolist() in ([-5, -1, 5, 9], [5, 9])
            return float(len(points))

    retrieve(*drives, Merged())


def test_a_field_that_is_not_there(drives):
    class Colour(Highest):
        point_fields = ("colour",)

    with pytest.raises(
        InputError, match="a: its points have no field 'colour'"
    ):
        retrieve(*drives, Colour())


def test_batches_are_as_large_as_wished_and_in_order(drives):
    sizes = []

    class Batches(Highest):
        batch_size = 4

        def describe_batch(self, clouds, *, of_places):
            sizes.append((len(clouds), of_places))
            return [self.describe(cloud) for cloud in clouds]

    found = retrieve(*drives, Batches())
    np.testing.assert_array_equal(
        found.scores, retrieve(*drives, Highest()).scores
    )
    assert sizes == [(4, True), (2, True), (4, False), (2, False)]


def test_a_batch_that_loses_one(drives):
    class Loses(Highest):
        def describe_batch(self, clouds, *, of_places):
            return []

    with pytest.raises(InputError, match="list of length 0 instead of 1"):
        retrieve(*drives, Loses())


def test_places_described_in_another_way_stay_apart(drives):
    class Apart(Highest):
        batch_size = 3

        def describe_place(self, points):
            return self.describe(points) + 100.0

    scores = retrieve(*drives, Apart()).scores
    np.testing.assert_allclose(
        scores, -np.abs(np.arange(101, 107) - np.arange(1.1, 7)[:, None]),
        atol=1e-6,
    )  # fmt: skip


def test_earlier_queries_are_passed(drives):
    class Drives(Highest):
        def score_in_drive(self, queries, database, *, exhaustive=False):
            seen.append(len(queries))
            return self.score(queries[0], database)

    seen = []
    scores = retrieve(*drives, Drives()).scores
    assert seen == [1, 2, 3, 4, 5, 6]
    # All queries score as the first does.
    np.testing.assert_array_equal(scores, np.tile(scores[0], (6, 1)))


class TwoStages(Highest):
    """A second stage that reverses the order of the first one."""

    rerank_best = 3

    def rerank(self, query, places, scores):
        assert (np.diff(scores) <= 0).all()
        assert query.shape == (2, 3)
        heights = [place[:, 2].max() for place in places]
        np.testing.assert_allclose(
            scores, -np.abs(np.array(heights) - query[:, 2].max()), atol=1e-6
        )
        return -scores


def test_a_second_stage_sees_points(drives):
    first = retrieve(*drives, Highest()).scores
    second = retrieve(*drives, TwoStages()).scores
    for one, other in zip(first, second, strict=True):
        best = np.argsort(-one, kind="stable")[:3]
        np.testing.assert_array_equal(other[best], -one[best])
        assert np.isnan(np.delete(other, best)).all()


def test_folders_of_scans_use_both_stages(drives, tmp_path):
    for name, heights in (("db", [1.0, 2.0, 3.0, 4.0]), ("q", [1.2])):
        (tmp_path / name).mkdir()
        for k, height in enumerate(heights):
            points = np.array([[5, 0, height], [9, 1, 0]], np.float32)
            np.save(tmp_path / name / f"{k}.npy", points)
    out = tmp_path / "scores.csv"
    write_scores(TwoStages(), tmp_path / "db", tmp_path / "q", out)
    values = [row.split(",")[2] for row in out.read_text().splitlines()[1:]]
    np.testing.assert_allclose(
        np.array(values[:3], float), [0.2, 0.8, 1.8], atol=1e-6
    )
    assert values[3] == ""


@pytest.mark.parametrize(
    "scores",
    [
        None,
        1.0,
        [1.0],
        np.zeros((6, 1)),
        "abc",
        [None] * 7,
        [[1.0], [1.0, 2.0]],
        ["1"] * 6,
        np.zeros(6) + 1j,
        [1.0 + 1j] * 6,
        np.ma.masked_less(np.arange(6.0), 3.0),
        np.ma.masked_array(np.arange(6.0)),
    ],
)
def test_scores_that_are_none(drives, scores):
    class Wrong(Highest):
        def score(self, query, database, *, exhaustive=False):
            return scores

    with pytest.raises(
        InputError, match=r"highest: score returned .* instead of 6"
    ):
        place_outcome(*drives, Wrong())


def test_rows_of_different_lengths_are_no_score_of_one_place(tmp_path):
    class Ragged(Highest):
        def score(self, query, database, *, exhaustive=False):
            return [[1.0], [1.0, 2.0]]

    drives = (record(tmp_path / name, [1.0]) for name in "ab")
    with pytest.raises(InputError, match=r"list of shape \(0,\) .* 1 numbers"):
        place_outcome(*drives, Ragged())


class SomeNan(Highest):
    """Lacks some scores of the queries after the second one."""

    part = slice(None)

    def score_in_drive(self, queries, database, *, exhaustive=False):
        scores = self.score(queries[-1], database)
        if len(queries) > 2:
            scores[self.part] = np.nan
        return scores


@pytest.mark.parametrize(
    ("part", "number"), [(slice(None), 6), (slice(0, None, 2), 3)]
)
def test_scores_that_are_nan_name_the_query(
    drives, tmp_path, monkeypatch, part, number
):
    monkeypatch.setattr(SomeNan, "part", part)
    frame = retrieve(*drives, Highest()).query_frames[2]
    fault = f"highest: .*query at frame {frame}: {number} of 6 scores are NaN"
    with pytest.raises(InputError, match=fault):
        place_outcome(*drives, SomeNan())
    for name in ("db", "q"):
        (tmp_path / name).mkdir()
        for k in range(6):
            points = np.array([[5, 0, k], [9, 1, 0]], np.float32)
            np.save(tmp_path / name / f"{k}.npy", points)
    out = tmp_path / "scores.csv"
    with pytest.raises(InputError, match=r"q/2\.npy: \d of 6 scores"):
        write_scores(SomeNan(), tmp_path / "db", tmp_path / "q", out)
    monkeypatch.setattr(SomeNan, "skips_places", True)
    assert np.isnan(retrieve(*drives, SomeNan()).scores).any()


@pytest.mark.parametrize("name", shipped_methods())
def test_each_setting_is_read_from_the_text_of_an_option(name):
    method = make_method(name, {})
    for setting, value in method.config:
        if value is None:
            continue
        values = value if isinstance(value, tuple) else None
        text = str(value) if values is None else tuple(map(str, values))
        read = make_method(name, {setting: text})
        assert getattr(read.config, setting) == value, setting


def test_scores_are_centred_by_an_option():
    for text, expected in (("true", True), ("false", False)):
        method = make_method("ring++", {"center_scores": text})
        assert method.config.center_scores is expected
