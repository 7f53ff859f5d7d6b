"""Localisation of scans in a map, against scenes with known answers."""

from contextlib import nullcontext
from csv import DictReader
from dataclasses import fields
import json
import math
from pathlib import Path
import sys

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.internal.eval_program import assert_refused, run
from helpers.point_street import street
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evaluation.base import InputError, from_xyz, poses
from evaluation.drives import open_drive
from evaluation.localisation import (
    METHODS,
    QUERY,
    InitialPose,
    Localised,
    Localiser,
    Query,
    Settings,
    Starts,
    default_settings,
    localise,
    make_estimator,
    make_map,
    map_of,
    mapped_frames,
    note_sparse,
    read_queries,
)
from evaluation.recognition import auroc, numbers_of

SHIPPED = [name for name in METHODS if name != "kiss-matcher"]
# Each point of a scan is in a voxel of its own.
EXACT = Settings(scan_voxel=1e-3)
P_BS = (0.7, -0.4, 1.9)
PROJECT = Path(__file__).parents[3]
QUAT_BS = Rotation.from_euler("ZYX", [140.0, 12.0, -7.0], degrees=True)


def localiser(points, method, settings=EXACT):
    place = map_of(points, "map", settings.neighbours)
    return Localiser(place, make_estimator(method, settings), settings)


def one_query(found, X_WS, scan_W, offset, turn, R_WT=None):
    scan = from_xyz(poses.transform(poses.inverse(X_WS), scan_W))
    R_WT = np.eye(3) if R_WT is None else R_WT
    initial = InitialPose.moved(X_WS, offset, turn)
    return found.query(Query(3, 0, scan, X_WS, R_WT), initial)[0]


def a_pose(*p, far=0.0):
    R = Rotation.from_euler("ZYX", [100.0, 8.0, -5.0], degrees=True)
    return poses.make_pose(R.as_matrix(), np.array(p) + far)


@pytest.mark.parametrize("method", SHIPPED)
def test_the_truth_on_a_perfect_map_stays(method):
    points = street()
    row = one_query(
        localiser(points, method),
        a_pose(1.0, 2.0, 1.7),
        points,
        *np.zeros((2, 3)),
    )
    # VGICP's Gaussians of voxels are not the points themselves.
    limit = 0.01 if method == "vgicp" else 1e-6
    assert row["translation_error"] < limit
    assert row["rotation_error_deg"] < 10.0 * limit
    assert row["fit"] == 1.0 == row["own_score"]
    assert row["residual"] < limit
    assert row["unmapped"] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "method",
    [
        "plane-icp",
        "gicp",
        "vgicp",
        pytest.param("robust-gicp", marks=pytest.mark.night),
    ],
)
def test_another_sample_of_the_same_street_is_found(method):
    found = localiser(street(0), method, default_settings(method))
    starts = Starts(0.5, 2.0)
    errors = []
    near = street(50, density=2.0)
    # As few as show a share of 0.98.
    for frame in range(50):
        X_WS = a_pose(-10.0 + frame / 3.1, math.sin(frame), 1.7)
        offset, turn = starts.draw(frame)
        errors.append(one_query(found, X_WS, near, offset, turn))
    assert Localised(np.array(errors, QUERY)).success >= 0.98


ROBUST = ("robust-plane-icp", "robust-gicp")


@pytest.mark.parametrize("method", ROBUST)
@pytest.mark.parametrize("frame", range(2))
def test_a_moved_wall_misleads_only_plain_estimators(method, frame):
    points = street()
    moved = points + [0.0, 0.5, 0.0] * (points[:, 1:2] >= 10.0)
    X_WS = a_pose(-5.0, 1.0, 1.7)
    errors = {}
    for one in (method, method.removeprefix("robust-")):
        found = localiser(moved, one, default_settings(one))
        start = Starts(0.5, 2.0).draw(frame)
        errors[one] = one_query(found, X_WS, street(50), *start)
    plain = errors.pop(method.removeprefix("robust-"))["translation_error"]
    row = errors[method]
    assert row["translation_error"] < 0.02 < 2.0 * plain
    assert row["rotation_error_deg"] < 0.1
    assert row["iterations"] > 3


@pytest.mark.parametrize("method", ["icp", "plane-icp", "gicp"])
def test_two_parallel_walls_lose_along_them(method):
    # The axes of the world are oblique to the walls.
    turn = Rotation.from_euler("z", 33.0, degrees=True).as_matrix()
    X_WS = a_pose(0.0, 0.0, 1.7)
    deviations = {}
    for ends in (True, False):
        points = street(0, ends=ends) @ turn.T
        scan = street(70, ends=ends)
        # The scan ends before the walls do.
        scan = scan[np.abs(scan[:, 0]) < 20.0] @ turn.T
        row = one_query(
            localiser(points, method), X_WS, scan, turn[:, 0], np.zeros(3), turn
        )
        deviations[ends] = [row[f"std_{k}"] for k in ("along", "across", "up")]
        if not ends:
            assert abs(row["across"]) < 0.1
            assert abs(row["up"]) < 0.1
            assert abs(row["along"]) > 0.2
    along, across, up = deviations[False]
    assert along > 1.0
    assert max(across, up) < 0.1
    assert max(deviations[True]) < 0.02


def test_errors_of_a_start_that_stays(tmp_path):
    own = tmp_path / "stay.py"
    own.write_text("def stay(map, scan, start):\n    return start, len(scan)\n")
    found = localiser(street(), str(own))
    axes = Rotation.from_euler("ZYX", [30.0, -4.0, 0.0], degrees=True)
    R_WT = axes.as_matrix()
    turn = np.radians(7.0) * np.array([0.6, 0.0, 0.8])
    row = one_query(
        found,
        a_pose(1.0, 2.0, 1.7),
        street(),
        R_WT @ [3.0, -2.0, 6.0],
        turn,
        R_WT,
    )
    ends = [row[name] for name in ("along", "across", "up")]
    assert ends == pytest.approx([3.0, -2.0, 6.0], abs=1e-9)
    assert row["translation_error"] == pytest.approx(7.0)
    assert row["rotation_error_deg"] == pytest.approx(7.0)
    assert row["own_score"] == len(street())
    assert row["fit"] < 0.5


def test_starts_lie_on_a_sphere_and_depend_on_seed_and_frame_alone():
    starts = Starts(2.0, 10.0, 3)
    drawn = np.array([starts.draw(frame) for frame in range(2000)])
    lengths = np.linalg.norm(drawn, axis=2)
    assert np.allclose(lengths, [2.0, math.radians(10.0)])
    # Uniform on a sphere: mean 0, and a third of the square on each axis.
    assert np.abs(drawn[:, 0].mean(axis=0)).max() < 0.1
    assert (drawn[:, 0] ** 2).mean(axis=0) == pytest.approx(4.0 / 3.0, rel=0.1)
    assert np.array_equal(starts.draw(7), Starts(2.0, 10.0, 3).draw(7))
    assert not np.array_equal(starts.draw(7), Starts(2.0, 10.0, 4).draw(7))


def write_street(folder, name, side, seed, *, far=0.0):
    """Records a drive of twelve scans with an oblique mount, turning."""
    X_BS = poses.make_pose(QUAT_BS.as_matrix(), np.array(P_BS))
    X_WBs = [yaw_pose(-11.0 + 2 * i, side, 0.0, 0.05 * i) for i in range(12)]
    scans = [
        make_scan(
            poses.transform(poses.inverse(X_WB @ X_BS), street(seed + 40 * i))
        )
        for i, X_WB in enumerate(X_WBs)
    ]
    for X_WB in X_WBs:
        X_WB[:2, 3] += far
    write_recording(
        folder / name, scans, X_WBs, p_BS=P_BS, quat_xyzw_BS=QUAT_BS.as_quat()
    )
    return folder / name


@pytest.fixture(scope="module")
def streets(tmp_path_factory):
    folder = tmp_path_factory.mktemp("streets")
    return {
        "map": write_street(folder, "map", 0.0, 0),
        "query": write_street(folder, "query", 1.0, 1000),
        "away": write_street(folder, "away", 0.0, 1000, far=4000.0),
    }


@pytest.mark.slow
def test_drives_with_an_oblique_mount(streets, tmp_path, capsys):
    both = ["localise", streets["map"], streets["query"], "--method", "gicp"]
    options = ["--query-spacing", "2", "--jobs", "2", "--output", tmp_path]
    status, out, _ = run(capsys, *both, *options, "--json")
    assert status == 0
    values = json.loads(out)
    assert values["queries"] == 12
    assert values["success_03m_1deg"] == 1.0 == values["success_2m_5deg"]
    assert values["translation_median"] < 0.02
    assert values["translation_95"] < 0.05
    assert values["rotation_median_deg"] < 0.1
    # All are right: there is nothing to separate.
    assert values["auroc_own_score"] is None
    lines = (tmp_path / "localisation.csv").read_text().splitlines()
    assert lines[0] == ",".join(QUERY.names)
    assert len(lines) == 13
    status, out, _ = run(capsys, *both, *options)
    assert status == 0
    assert "within 0.3 m and 1 deg" in out


@pytest.mark.slow
def test_a_cloud_as_map_and_a_cloud_as_query(streets, tmp_path, capsys):
    X_WS = a_pose(1.0, 2.0, 1.7)
    np.save(
        tmp_path / "map.npy", poses.transform(poses.inverse(X_WS), street())
    )
    np.save(
        tmp_path / "scan.npy", poses.transform(poses.inverse(X_WS), street(80))
    )
    np.save(tmp_path / "world.npy", street())
    for pair, number in (
        (("map.npy", "scan.npy"), 1),
        (("world.npy", streets["query"]), 3),
    ):
        paths = [tmp_path / one for one in pair]
        command = ["localise", *paths, "--method", "plane-icp", "--json"]
        status, out, _ = run(capsys, *command)
        assert status == 0
        values = json.loads(out)
        assert values["queries"] == number
        assert values["translation_95"] < 0.05


@pytest.mark.slow
@pytest.mark.sampled(2)
@pytest.mark.parametrize("method", SHIPPED)
def test_order_does_not_matter(streets, method):
    drive = open_drive(streets["query"])
    place = make_map(open_drive(streets["map"]), Settings())
    assert mapped_frames(streets["map"], place, drive).all()
    columns = [name for name in QUERY.names if name != "seconds"]
    starts = Starts(1.0, 5.0)
    settings = Settings()
    found = Localiser(place, make_estimator(method, settings), settings)
    there, back = (
        localise([found], read_queries(drive, frames), [starts], drive.name, 3)[
            0
        ]
        for frames in (range(0, 12, 4), range(8, -1, -4))
    )
    for name in columns:
        assert np.array_equal(there[name], back[::-1][name])


@pytest.mark.slow
def test_processes_change_nothing(streets, tmp_path, capsys):
    both = ["localise", streets["map"], streets["query"], "--method", "gicp"]
    rows = []
    for jobs in 1, 2:
        output = tmp_path / str(jobs)
        options = ["--query-spacing", "4", "--jobs", jobs, "--output", output]
        assert run(capsys, *both, *options)[0] == 0
        with open(output / "localisation.csv", newline="") as stream:
            rows.append([{**row, "seconds": ""} for row in DictReader(stream)])
    assert len(rows[0]) > 2
    assert rows[0] == rows[1]


@pytest.mark.slow
def test_a_process_that_is_killed_is_an_error(streets, tmp_path, capsys):
    path = tmp_path / "hungry.py"
    path.write_text(
        "import os, signal\n"
        "def localise(map, scan, start):\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    command = ["localise", streets["map"], streets["query"], "--method", path]
    status, out, err = run(capsys, *command, "--jobs", "2")
    assert (status, out) == (1, "")
    assert "Traceback" not in err
    assert "SIGKILL, perhaps for lack of memory" in err.splitlines()[-1]


def test_far_coordinates_lose_nothing():
    # As of a survey grid.
    rows = []
    for far in (0.0, 5e5):
        shift = far * np.array([1.0, 8.0, 0.0])
        found = localiser(street() + shift, "gicp")
        X_WS = a_pose(1.0, 2.0, 1.7)
        X_WS[:3, 3] += shift
        offset, turn = Starts(0.5, 2.0).draw(1)
        rows.append(one_query(found, X_WS, street(9) + shift, offset, turn))
    for name in ("translation_error", "rotation_error_deg", "along"):
        assert rows[0][name] == pytest.approx(rows[1][name], abs=1e-4)


def values_of(rows):
    numbers = numbers_of("localise", Localised(rows))
    return {one.metric: one.value for one in numbers}


def with_scores(scores, wrong):
    rows = np.zeros(len(scores), QUERY)
    rows["own_score"], rows["fit"] = scores, scores
    rows["translation_error"] = np.where(wrong, 5.0, 0.0)
    return values_of(rows)


def test_whether_an_estimator_knows():
    # Right ends score 11 to 30, of which 12 to 30 are believed: 19 of 20.
    scores = [*range(11, 31), 12.0, 11.9, 3.0, 40.0]
    values = with_scores(scores, [False] * 20 + [True] * 4)
    assert values["believed_from"] == 11.0
    scores = [*range(11, 51), 12.5, 12.0, 3.0, 90.0]
    values = with_scores(scores, [False] * 40 + [True] * 4)
    assert values["believed_from"] == 12.0
    # Wrong ones at 12.5, 12 (believed, as is 90), and 3.
    assert values["confident_wrong"] == pytest.approx(3 / 44)
    assert values["confident_of_wrong"] == pytest.approx(3 / 4)
    # Pairs that are ordered: 38 + 38.5 + 40 + 0 of 160.
    assert values["auroc_own_score"] == pytest.approx(116.5 / 160)
    assert values["success_03m_1deg"] == pytest.approx(40 / 44)
    assert values["translation_median"] == 0.0
    nothing = with_scores([1.0, 2.0], [True, True])
    for name in ("auroc_own_score", "believed_from", "confident_wrong"):
        assert math.isnan(nothing[name])
    assert math.isnan(nothing["confident_of_wrong"])


def test_auroc_of_scores():
    is_high = np.array([True, True, False, False])
    assert auroc(np.array([2.0, 3.0, 1.0, 0.0]), is_high) == 1.0
    assert auroc(np.array([1.0, 1.0, 1.0, 1.0]), is_high) == 0.5
    assert auroc(np.array([np.nan, 3.0, 1.0, 2.0]), is_high) == 0.5
    assert math.isnan(auroc(np.zeros(4), np.ones(4, bool)))


@pytest.mark.parametrize(("number", "is_sparse"), [(9, True), (10, False)])
def test_a_scan_of_few_points_is_a_failure(number, is_sparse):
    found = localiser(street(), "icp")
    X_WS = a_pose(0, 0, 1.7)
    still = np.zeros((2, 3))
    rows = np.array(
        [
            one_query(found, X_WS, street()[:number], *still),
            one_query(found, X_WS, street(), *still),
        ]
    )
    values = values_of(rows)
    notes = []
    note_sparse("town", rows, notes.append)
    assert values["success_03m_1deg"] == (0.5 if is_sparse else 1.0)
    assert values["without_pose"] == int(is_sparse) == len(notes)
    assert values["unmapped_mean"] == 0.0
    counts = {n.metric: n.n for n in numbers_of("localise", Localised(rows))}
    assert counts["success_03m_1deg"] == 2
    assert counts["translation_95"] == counts["up_median"] == 2 - is_sparse
    assert notes == [] or notes[0].startswith("town: 1 of 2 scans")


OWN = {
    "no_rotation": (
        "import numpy as np\ndef f(map, scan, start):\n"
        "    return np.diag([2.0, 1.0, 1.0, 1.0]), 1.0\n",
        "returned no pose",
    ),
    "mirror": (
        "import numpy as np\ndef f(map, scan, start):\n"
        "    return np.diag([-1.0, 1.0, 1.0, 1.0]), 1.0\n",
        "returned no pose",
    ),
    "alone": (
        "def f(map, scan, start):\n    return start\n",
        "instead of a pose",
    ),
    "fault": (
        "def f(map, scan, start):\n    return 1 / 0, 1.0\n",
        "line 2: ZeroDivisionError",
    ),
    "empty": ("x = 1\n", "has 0 functions"),
    "several": (
        "def f(map, scan, start):\n    pass\ndef g(): pass\n",
        "has 2 functions",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", OWN)
def test_faults_of_an_own_method(streets, tmp_path, capsys, name):
    text, fault = OWN[name]
    path = tmp_path / f"{name}.py"
    path.write_text(text)
    command = ["localise", streets["map"], streets["query"], "--method", path]
    assert_refused(capsys, [*command, "--jobs", "1"], str(path), fault)
    status, out, err = run(capsys, *command, "--jobs", "2")
    assert status in (1, 2)
    assert out == ""
    assert "Traceback" not in err
    assert str(path) in err.splitlines()[-1]
    assert fault in err.splitlines()[-1]


def test_numbers_of_jobs(streets, capsys):
    command = ["localise", streets["map"], streets["query"], "--method", "icp"]
    for jobs in (0, -1):
        assert_refused(capsys, [*command, "--jobs", jobs], f"--jobs: {jobs}")


def test_points_that_are_not_finite_are_noted(streets, tmp_path, capsys):
    cloud = street()
    for name, holes in (("map", 7), ("scan", 5)):
        points = cloud.copy()
        points[:holes, 1] = np.nan
        np.save(tmp_path / f"{name}.npy", points)
    pair = [tmp_path / "map.npy", tmp_path / "scan.npy"]
    status, _, err = run(capsys, "localise", *pair, "--method", "gicp")
    assert status == 0
    for note in ("map.npy: 7", "scan.npy: 5"):
        assert f"{note} points are not finite, and left out" in err
    # Drives without such points have no note.
    pair = [streets["map"], streets["query"]]
    _, _, err = run(capsys, "localise", *pair, "--method", "gicp")
    assert "not finite" not in err


def test_results_of_an_earlier_run_go(streets, tmp_path, capsys):
    pair = [streets["map"], streets["query"]]
    output = tmp_path / "out"
    command = ["localise", *pair, "--method", "gicp", "--output", output]
    assert run(capsys, *command, "--track")[0] == 0
    (output / "notes.txt").write_text("mine")
    tables = {"results.csv", "queries.csv", "localisation.csv"}
    names = {path.name for path in output.iterdir()}
    assert names == {*tables, "track.png", "notes.txt"}
    assert run(capsys, *command)[0] == 0
    names = {path.name for path in output.iterdir()}
    assert names == {*tables, "notes.txt"}
    (output / "results.csv").write_text("mine")
    assert_refused(capsys, command, "csv: no earlier run wrote it")


def test_bad_input(streets, tmp_path, capsys, monkeypatch):
    pair = [streets["map"], streets["query"]]
    gicp = ["--method", "gicp"]
    np.save(tmp_path / "none.npy", np.zeros((0, 3)))
    np.save(tmp_path / "few.npy", np.ones((500, 3)))
    np.save(tmp_path / "street.npy", street())
    for arguments, *words in (
        ([*pair, *gicp, "--start", "0"], "--start: 0 m"),
        ([*pair, *gicp, "--seed", "-1"], "--seed"),
        ([*pair, *gicp, "--query-spacing", "0"], "--query-spacing: 0"),
        (
            [*pair, *gicp, "--track", "--query-spacing", "10"],
            "--query-spacing: not together",
        ),
        (
            [*pair, *gicp, "--odometry-drift", "0.01"],
            "--odometry-drift: only together",
        ),
        (
            [tmp_path / "street.npy", pair[1], *gicp, "--align", "always"],
            "--align always: ",
            "street.npy",
        ),
        ([*pair, *gicp, "--set", "wide=1"], "gicp has no setting 'wide'"),
        ([*pair, "--method", "ndt"], "no method 'ndt'"),
        ([streets["map"], streets["away"], *gicp], "away", "the nearest scan"),
        ([tmp_path / "none.npy", pair[1], *gicp], "none.npy", "0 points"),
        ([pair[0], tmp_path / "none.npy", *gicp], "none.npy: no scan has 10"),
        ([tmp_path / "street.npy", streets["away"], *gicp], "the nearest scan"),
    ):
        assert_refused(capsys, ["localise", *arguments], *words)
    monkeypatch.setitem(sys.modules, "kiss_matcher", None)
    assert_refused(
        capsys,
        ["localise", *pair, "--method", "kiss-matcher"],
        "not installed",
        "cns-eval[kiss-matcher]",
    )


def test_settings_are_checked():
    changed = Settings().with_values(
        [("width", "1.5"), ("neighbours", "20")], "gicp"
    )
    assert (changed.width, changed.neighbours) == (1.5, 20)
    for name, value in (("width", "0"), ("neighbours", "3"), ("voxel", "-1")):
        with pytest.raises(InputError, match=name):
            Settings().with_values([(name, value)], "gicp")


@pytest.mark.parametrize(
    ("method", "lacks"),
    [
        ("gicp", {"resolution"}),
        ("robust-gicp", {"resolution"}),
        ("vgicp", set()),
        ("kiss-matcher", {"width", "last_width", "iterations"}),
        ("x.py", {"resolution", "width", "last_width", "iterations"}),
    ],
)
def test_a_setting_that_a_method_lacks_is_refused(method, lacks):
    for one in fields(Settings):
        with (
            nullcontext()
            if one.name not in lacks
            else pytest.raises(
                InputError, match=f"{method} has no setting '{one.name}'"
            )
        ):
            Settings().with_values([(one.name, 5)], method)


@pytest.mark.slow
def test_the_method_in_the_documents(streets, capsys):
    path = PROJECT / "docs/examples/robust_plane_icp.py"
    command = ["localise", streets["map"], streets["query"], "--json"]
    options = ["--method", path, "--query-spacing", "8", "--start", "1"]
    status, out, _ = run(capsys, *command, *options)
    assert status == 0
    values = json.loads(out)
    assert values["method"] == "robust_plane_icp"
    assert values["success_03m_1deg"] == 1.0
    assert values["translation_95"] < 0.02
