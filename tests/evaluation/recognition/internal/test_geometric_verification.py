"""Geometric verification, by poses that are made by hand."""

import csv
import json

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.internal.eval_program import run as run_program
from helpers.measured_pairs import place_outcome
import numpy as np
import pytest

from cns_drake.base import InputError
from evaluation.drives import open_drive
from evaluation.methods import Method, MethodConfig, make_method
from evaluation.recognition import RetrievalProtocol, retrieve
from evaluation.recognition.geometric_verification import (
    NUM_VERIFIED,
    SOFTNESS,
    verification_weight,
    verified_scores,
)

RADIUS = 8.0
# Up to this distance, a place has the full weight [m].
FULL = (1.0 - SOFTNESS) * RADIUS
# From this distance on, it has none [m].
NONE = (1.0 + SOFTNESS) * RADIUS


class Far(Method):
    """Has places at the distances in its database; None is no pose."""

    name = "far"
    Config = MethodConfig

    def describe(self, points):
        return points

    def build_database(self, places):
        return places

    def score(self, query, database, *, exhaustive=False):
        raise NotImplementedError

    def relative_pose(self, query, database, place):
        if database[place] is None:
            return None
        turn = 0.3 * place
        along = database[place] * np.array([np.cos(turn), np.sin(turn)])
        return yaw_pose(*along, 0.0, 2.0 * place)


def after(scores, distances):
    return verified_scores(
        Far(), None, distances, np.array(scores, float), [RADIUS]
    )[0]


def test_the_ramp():
    eps = 1e-9
    distances = [0.0, FULL - eps, FULL + eps, RADIUS, NONE - eps, NONE, 99.0]
    weight = verification_weight(np.array(distances), RADIUS)
    assert weight[:2].tolist() == [1.0, 1.0]
    assert 1.0 - 1e-8 < weight[2] < 1.0
    assert weight[3] == pytest.approx(0.5)
    assert 0.0 < weight[4] < 1e-8
    assert weight[5:].tolist() == [0.0, 0.0]
    # The weight falls linearly: a quarter of the way takes a quarter.
    assert verification_weight(
        FULL + 0.25 * (NONE - FULL), RADIUS
    ) == pytest.approx(0.75)
    # Other units of length change nothing.
    np.testing.assert_allclose(
        verification_weight(1e3 * np.array(distances), 1e3 * RADIUS),
        weight,
        atol=1e-9,
    )


def test_rejected_and_ranked_anew():
    middle = 0.5 * (FULL + RADIUS)
    found = after([0.9, 0.8, 0.7, np.nan], [NONE, middle, 1.0, 1.0])
    assert np.isnan(found[[0, 3]]).all()
    assert found[1] == pytest.approx(0.75 * 0.8)
    assert found[2] == 0.7
    assert np.nanargmax(found) == 2


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_negative_scores_fall_too(scale):
    found = after(-scale * np.array([1.0, 1.0, 2.0]), [RADIUS, 0.0, 0.0])
    np.testing.assert_allclose(found, -scale * np.array([1.5, 1.0, 2.0]))


def test_without_poses_nothing_changes():
    scores = np.random.default_rng(0).normal(size=NUM_VERIFIED + 20)
    scores[3] = np.nan
    found = after(scores, [None] * len(scores))
    np.testing.assert_array_equal(found, scores)
    assert np.isnan(after([np.nan, np.nan], [0.0, 0.0])).all()


def test_a_place_without_a_pose_keeps_its_score():
    found = after([0.9, 0.8, 0.7], [None, NONE, 0.0])
    np.testing.assert_array_equal(found, [0.9, np.nan, 0.7])


def test_only_the_best_are_looked_at():
    number = NUM_VERIFIED + 3
    scores = np.random.default_rng(1).permutation(number) / number
    found = after(scores, [0.0] * number)
    best = np.argsort(-scores)[:NUM_VERIFIED]
    assert np.flatnonzero(~np.isnan(found)).tolist() == sorted(best)
    np.testing.assert_array_equal(found[best], scores[best])


def test_of_equal_scores_the_first():
    found = after([0.5] * (NUM_VERIFIED + 1), [0.0] * (NUM_VERIFIED + 1))
    assert np.flatnonzero(np.isnan(found)).tolist() == [NUM_VERIFIED]


@pytest.mark.parametrize("pose", [np.eye(3), np.full((4, 4), np.nan), "x"])
def test_what_is_no_pose_is_refused(pose):
    class Wrong(Far):
        def relative_pose(self, query, database, place):
            return pose

    with pytest.raises(InputError, match="far: relative_pose returned"):
        verified_scores(Wrong(), None, [1.0], np.array([0.5]), [RADIUS])


def test_too_few_poses_are_refused():
    class Few(Far):
        def relative_poses(self, query, database, places):
            return [None]

    with pytest.raises(
        InputError, match="returned list of length 1 instead of 2"
    ):
        verified_scores(Few(), None, [1.0, 1.0], np.array([0.5, 0.5]), [RADIUS])


class Line(Method):
    """Scans contain their position; scores prefer places farther on."""

    name = "line"
    Config = MethodConfig

    def describe(self, points):
        return float(points[:, 2].max())

    def build_database(self, places):
        return np.array(places)

    def score(self, query, database, *, exhaustive=False):
        return 1.0 - 0.01 * np.abs(database - query - 12.0)

    def relative_pose(self, query, database, place):
        return yaw_pose(query - database[place], 0.0, 0.0, 0.0)


def record(folder, xs):
    scans = [make_scan(np.array([[5.0, 0.0, float(x)]])) for x in xs]
    X_WBs = [yaw_pose(x, 0.0, 0.0, 0.0) for x in xs]
    return open_drive(write_recording(folder, scans, X_WBs))


def test_a_pair_of_drives(tmp_path):
    database = record(tmp_path / "a", np.arange(0.0, 61.0, 5.0))
    query = record(tmp_path / "b", np.arange(1.0, 42.0, 10.0))
    free = place_outcome(database, query, Line())
    assert free.by_mode["all"].recall_at_1 == 0.0
    shut = place_outcome(
        database, query, Line(), protocol=RetrievalProtocol(verified=True)
    )
    assert shut.by_mode["all"].recall_at_1 == 1.0
    # The best place of each query is the farthest one that counts: 4 m ahead;
    # one 9 m ahead is rejected.
    np.testing.assert_allclose(shut.columns["distance"], 4.0)
    plain, verified = (
        retrieve(database, query, Line(), RetrievalProtocol(verified=verified))
        for verified in (False, True)
    )
    assert not np.isnan(plain.scores).any()
    far = verified.distances >= 7.5 * (1.0 + SOFTNESS)
    assert np.isnan(verified.scores[far]).all()
    # A wider radius accepts places 9 m ahead.
    wide = RetrievalProtocol(verified=True, radius=10.5)
    outcome = place_outcome(database, query, Line(), wide)
    np.testing.assert_allclose(outcome.columns["distance"], 9.0)


@pytest.mark.slow
def test_the_option_of_pr_and_scores(capsys, towns, tmp_path):
    both = [towns / "town_01", towns / "town_02", "--method", "layered-overlap"]
    status, out, _ = run_program(capsys, "pr", *both, "--verified", "--json")
    assert status == 0
    assert json.loads(out)["protocol"]["verified"] is True
    _, out, _ = run_program(capsys, "pr", *both, "--verified")
    assert "With geometric verification" in out
    tables = []
    for options in ((), ("--verified",), ("--verified", "--radius", "1000")):
        output = tmp_path / "scores.csv"
        status, _, _ = run_program(
            capsys,
            "pr",
            towns / "town_01_scans",
            towns / "town_02_scans",
            "--method",
            "layered-overlap",
            "--scores",
            output,
            *options,
        )
        assert status == 0
        with output.open(newline="") as stream:
            tables.append([row["score"] for row in csv.DictReader(stream)])
    free, shut, wide = tables
    assert wide == free
    assert shut != free
    # A rejected place has no score; a near one keeps its score.
    assert "" in shut
    assert any(
        one and one == other for one, other in zip(free, shut, strict=True)
    )


@pytest.mark.parametrize("name", ["ring++", "scan-context++", "solid"])
def test_shipped_methods_take_part(name, towns):
    drive = open_drive(towns / "town_01")
    method = make_method(name, {})
    shut = place_outcome(
        drive, drive, method, protocol=RetrievalProtocol(verified=True)
    )
    assert shut.by_mode["all"].recall_at_1 == 1.0
