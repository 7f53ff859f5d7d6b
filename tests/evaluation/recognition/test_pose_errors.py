"""Pose errors against given turns and moves."""

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.measured_pairs import place_outcome, values_of
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evaluation.base import InputError
from evaluation.drives import open_drive
from evaluation.methods import Method, MethodConfig
from evaluation.recognition import QueryOutcomes, pose_error


def random_pose(rng):
    X = np.eye(4)
    X[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    X[:3, 3] = rng.uniform(-50, 50, 3)
    return X


@pytest.mark.parametrize("angle_deg", [0.0, 1e-6, 4.0, 90.0, 179.999, 180.0])
def test_error_of_a_known_turn_and_move(angle_deg):
    rng = np.random.default_rng(int(angle_deg))
    X_WP, X_WQ = random_pose(rng), random_pose(rng)
    axis = rng.normal(size=3)
    turn = np.radians(angle_deg) * axis / np.linalg.norm(axis)
    error = np.eye(4)
    error[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    error[:3, 3] = [0.3, -0.4, 1.2]
    X_PQ = np.linalg.inv(X_WP) @ X_WQ @ error
    translation, rotation_deg = pose_error(X_PQ, X_WP, X_WQ)
    assert translation == pytest.approx(1.3, abs=1e-12)
    assert rotation_deg == pytest.approx(angle_deg, abs=2e-6)


def make_outcomes(scores, right, matched):
    ranks = np.where(right, 1.0, np.inf)
    return QueryOutcomes(
        np.array(scores), np.array(right), np.array(matched), ranks, 9
    )


def test_full_precision_that_is_never_reached():
    outcomes = make_outcomes([0.9, 0.8], [False, True], [True, True])
    assert outcomes.curve.recall_at_full_precision == 0.0
    outcomes = make_outcomes([np.nan], [False], [True])
    assert outcomes.curve.recall_at_full_precision == 0.0


class Poses(Method):
    """Scans contain their own pose, from which the method gets the truth."""

    name = "poses"
    Config = MethodConfig
    offset = 0.0

    def describe(self, points):
        # x, y and the yaw in steps of 0.1 rad, as three heights.
        return points[:, 2]

    def build_database(self, places):
        return np.array(places)

    def score(self, query, database, *, exhaustive=False):
        return -np.abs(database[:, :2] - query[:2]).sum(axis=1)

    def relative_pose(self, query, database, place):
        X_WP, X_WQ = (
            yaw_pose(x, y, 0.0, 0.1 * turn)
            for x, y, turn in (database[place], query)
        )
        X_PQ = np.linalg.inv(X_WP) @ X_WQ
        X_PQ[0, 3] += self.offset
        return X_PQ


def record(folder, places):
    scans = [
        make_scan(np.array([[5.0, k, value] for k, value in enumerate(place)]))
        for place in places
    ]
    X_WBs = [yaw_pose(x, y, 0.0, 0.1 * turn) for x, y, turn in places]
    return open_drive(write_recording(folder, scans, X_WBs))


def test_a_method_with_exact_poses(tmp_path):
    database = record(tmp_path / "a", [(10 * k, 0, k) for k in range(6)])
    query = record(tmp_path / "b", [(10 * k + 3, 2, -7 * k) for k in range(6)])
    method = Poses()
    outcome = place_outcome(database, query, method)
    values = values_of(outcome, "pose")
    assert values["pose_success"] == 1.0
    assert values["translation_90"] < 1e-3
    assert values["rotation_90_deg"] < 1e-3
    method.offset = 1.999
    outcome = place_outcome(database, query, method)
    values = values_of(outcome, "pose")
    assert values["translation_median"] == pytest.approx(1.999, abs=1e-3)
    assert values["pose_success"] == 1.0
    method.offset = 2.001
    outcome = place_outcome(database, query, method)
    assert values_of(outcome, "pose")["pose_success"] == 0.0


@pytest.mark.parametrize("value", [1.0, np.eye(3), np.eye(4, dtype=int), "x"])
def test_what_is_no_pose_is_refused(tmp_path, value):
    drive = record(tmp_path / "a", [(0, 0, 0)])

    class Wrong(Poses):
        def relative_pose(self, query, database, place):
            return value

    with pytest.raises(InputError, match="poses: relative_pose returned"):
        place_outcome(drive, drive, Wrong())
