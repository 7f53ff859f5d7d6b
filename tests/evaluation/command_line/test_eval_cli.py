import json
import subprocess
import sys

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.internal.eval_program import assert_refused, run
import numpy as np
import pytest

from evaluation.results import QueryRows, Results


def test_the_protocol_is_the_users(capsys, towns):
    both = ["pr", towns / "town_01", towns / "town_02", "--method", "solid"]
    _, out, _ = run(capsys, *both, "--json")
    values = json.loads(out)
    assert values["protocol"] == {
        "radius": 7.5,
        "query_spacing": 10.0,
        "place_spacing": 5.0,
        "half_extent": 100.0,
        "scans_per_place": 1,
        "place": None,
        "exclude_recent": None,
        "overlap": None,
        "verified": False,
        "turn_queries": True,
        "tilt_queries": 1.5,
        "hide_sector": 0.0,
        "seed": 0,
    }
    options = ["--protocol", "recorded"]
    options += ["--radius", "2", "--query-spacing", "20", "--half-extent", "30"]
    options += ["--scans-per-place", "2", "--place-spacing", "10"]
    status, out, _ = run(capsys, *both, *options, "--json")
    assert status == 0
    values = json.loads(out)
    assert values["queries"] == 4
    assert values["places"] == 8
    assert values["protocol"] == {
        "radius": 2.0,
        "query_spacing": 20.0,
        "place_spacing": 10.0,
        "half_extent": 30.0,
        "scans_per_place": 2,
        "place": "middle",
        "exclude_recent": None,
        "overlap": None,
        "verified": False,
        "turn_queries": False,
        "tilt_queries": 0.0,
        "hide_sector": 0.0,
        "seed": 0,
    }
    _, out, _ = run(capsys, *both, *options)
    assert "a match within 2 m" in out
    assert "2 scans a place, the middle scan gives the pose" in out
    _, out, _ = run(capsys, *both, *options, "--set", "place=first")
    assert "2 scans a place, the first scan gives the pose" in out


@pytest.mark.slow
def test_a_pair_writes_the_tables_of_a_study(capsys, towns, tmp_path):
    """Each row says how it was made; the answers give the results."""
    both = ["pr", towns / "town_01", towns / "town_02", "--method", "solid"]
    made = {}
    for name, *options in (
        ("random-yaw",),
        ("verified", "--verified"),
        ("wide", "--radius", "25"),
        ("high", "--sensor-height", "1.9"),
        ("set", "--set", "ranges=20"),
    ):
        out = tmp_path / name
        status, printed, _ = run(
            capsys, *both, *options, "--json", "--output", out
        )
        assert status == 0
        # As in all studies, there are rows without the verified and with it.
        verified = "--verified" in options
        rows = Results.read(out).where(task="place", verified=verified).rows
        (answers,) = (
            one
            for one in QueryRows.read(out).answers
            if one.verified == verified
        )
        values = {row.metric: row.value for row in rows}
        assert values["auc"] == json.loads(printed)["auc"]
        assert answers.outcomes.recall_at(1) == values["r1"]
        assert {row.n for row in rows} == {len(answers.outcomes)}
        made[name] = rows[0]
    digests = {name: row.protocol_digest for name, row in made.items()}
    assert digests["random-yaw"] == digests["verified"] == digests["set"]
    assert len({digests[name] for name in ("random-yaw", "wide", "high")}) == 3
    assert made["set"].label == "solid, ranges 20"
    assert [made[one].protocol for one in made] == [
        "random-yaw",
        "random-yaw",
        "own",
        "own",
        "random-yaw",
    ]
    both = ["compare", tmp_path / "random-yaw", tmp_path / "wide"]
    assert_refused(capsys, both, "no condition in common")


@pytest.mark.slow
def test_protocols_have_names_and_single_options_replace_their_fields(
    capsys, towns
):
    both = ["pr", towns / "town_01", towns / "town_02", "--method", "btc"]

    def asked(*options):
        status, out, _ = run(capsys, *both, *options, "--json")
        assert status == 0
        values = json.loads(out)["protocol"]
        names = ("turn_queries", "tilt_queries", "place")
        return tuple(values[name] for name in names)

    assert asked() == asked("--protocol", "random-yaw") == (True, 1.5, "middle")
    assert asked("--protocol", "paper") == (False, 0.0, "first")
    assert asked("--protocol", "recorded") == (False, 0.0, "middle")
    assert asked("--no-turn-queries") == (False, 1.5, "middle")
    assert asked("--tilt-queries", "0") == (True, 0.0, "middle")
    assert asked("--protocol", "paper", "--turn-queries") == (
        True,
        0.0,
        "first",
    )
    wrong = [*both, "--protocol", "own"]
    assert_refused(capsys, wrong, "'own' is not one of")


def test_queries_are_turned(capsys, towns):
    both = ["pr", towns / "town_01", towns / "town_02", "--method", "solid"]
    both += ["--protocol", "recorded"]
    options = ["--turn-queries", "--tilt-queries", "2", "--hide-sector", "60"]
    found = []
    for more in ([], options, [*options, "--seed", "1"], options):
        status, out, _ = run(capsys, *both, *more, "--json")
        assert status == 0
        found.append(json.loads(out))
    protocol = found[1]["protocol"]
    assert protocol["turn_queries"]
    assert (protocol["tilt_queries"], protocol["hide_sector"]) == (2.0, 60.0)
    assert found[1] == found[3]
    errors = [one["rotation_median_deg"] for one in found]
    assert errors[1] != errors[2] != errors[0]
    _, out, _ = run(capsys, *both, *options)
    assert "each query with a random yaw" in out
    for option, value in (
        ("--tilt-queries", "91"),
        ("--tilt-queries", "nan"),
        ("--hide-sector", "360"),
        ("--seed", "-1"),
    ):
        assert_refused(capsys, [*both, option, value], f"{option}: {value}")


# The verdict on drives of cns-drake, which is told first.
SHARED = "world: all poses are in frame 'map', which drives share\n"


def test_tcr_json(capsys, towns):
    status, out, err = run(
        capsys, "tcr", towns / "town_01", towns / "town_02", "--json"
    )
    values = json.loads(out)
    assert status == 0
    assert err == SHARED
    assert json.loads(out)["world"] == {
        "shared": True,
        "aligned": False,
        "why": "all poses are in frame 'map', which drives share",
    }
    assert {
        "tcr_sym",
        "tcr_source_to_target",
        "tcr_target_to_source",
        "in_hull",
        "unchanged",
    } <= values.keys()
    assert 0.0 <= values["tcr_sym"] < 0.05
    assert values["in_hull"] > 100


def test_drives_far_apart_say_why_nothing_is_measured_where_both_drove(
    capsys, tmp_path
):
    a, b = (tmp_path / f"town_0{stage}" for stage in (1, 2))
    near = np.random.default_rng(1).uniform(-40.0, 40.0, (400, 3))
    for path, y in ((a, 0.0), (b, 100.0)):
        poses = [yaw_pose(3.0 * i, y, 0.0, 0.0) for i in range(5)]
        scans = [make_scan(near) for _ in poses]
        write_recording(path, scans, poses)
    status, out, _ = run(capsys, "tcr", a, b)
    assert status == 0
    assert "undefined  (no point lies within 40 m of both routes)" in out


def test_tcr_undefined_is_null_with_a_reason(capsys, towns, tmp_path):
    np.save(tmp_path / "empty.npy", np.empty((0, 3)))
    arguments = ("tcr", towns / "town_01.npy", tmp_path / "empty.npy")
    status, out, _ = run(capsys, *arguments, "--json")
    assert status == 0
    values = json.loads(out)
    assert values["tcr_sym"] is None
    assert values["reason"]
    status, out, _ = run(capsys, *arguments)
    assert status == 0
    assert "undefined" in out


def test_pr_json(capsys, towns):
    status, out, err = run(
        capsys,
        "pr",
        towns / "town_01",
        towns / "town_02",
        "--method",
        "scan-context++",
        "--json",
    )
    assert status == 0
    assert err == SHARED
    assert json.loads(out)["world"] == {
        "shared": True,
        "aligned": False,
        "why": "all poses are in frame 'map', which drives share",
    }
    values = json.loads(out)
    assert {
        "method",
        "mode",
        "auc",
        "recall_at_1",
        "recall_at_n",
        "f1_max",
        "queries",
        "queries_with_match",
        "true_positives",
    } <= values.keys()
    assert values["method"] == "scan-context++"
    assert values["mode"] == "all"
    # Every scene differs; a side step of 1 m hides none of them.
    assert values["recall_at_1"] == values["auc"] == 1.0
    assert values["true_positives"] == values["queries"] == 8


def test_pr_table_modes_and_parameters(capsys, towns):
    arguments = (
        "pr",
        towns / "town_01",
        towns / "town_02",
        "--method",
        "scan-context++",
        "--mode",
        "filtered",
        "--set",
        "variant=polar",
        "--set",
        "candidates=3",
        "--sensor-height",
        "1.8",
    )
    status, out, _ = run(capsys, *arguments)
    assert status == 0
    for text in (
        "filtered",
        "R@1 ",
        "TP 8 of N 8",
        "AUC",
        "F1max",
        " of TP + FP + FN 8)",
        "R@1%",
    ):
        assert text in out
    _, out, _ = run(capsys, *arguments, "--json")
    parameters = json.loads(out)["parameters"]
    assert parameters["variant"] == "polar"
    assert parameters["candidates"] == 3
    assert parameters["sensor_height"] == 1.8


@pytest.mark.slow
def test_help_is_instant_and_modules_stay_apart():
    # The imported modules are tested in place of a time.
    code = (
        "import sys; sys.argv = ['cns-eval', '--help']\n"
        "from evaluation import command_line as cli\n"
        "try: cli.main()\n"
        "except SystemExit as e: assert not e.code, e.code\n"
        "heavy = {'numpy', 'scipy', 'numba', 'matplotlib', 'mcap', 'rosbags',"
        " 'pydrake', 'open3d'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    for command in ("tcr", "pr", "localise", "report"):
        assert command in done.stdout


@pytest.mark.slow
def test_the_module_is_the_program(towns):
    done = subprocess.run(
        [sys.executable, "-m", "evaluation", "tcr", "nowhere", "nowhere"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2
    # On a slow machine, what the program does stands before the fault.
    *_, fault = done.stderr.splitlines()
    assert fault == "cns-eval: error: nowhere: no such file or folder"


def test_parameters_of_several_numbers(capsys, towns):
    both = ["pr", towns / "town_01", towns / "town_02", "--json"]
    both += ["--method", "scan-context++", "--set", "variant=cart"]
    status, out, _ = run(capsys, *both, "--set", "cart_cell=10,4")
    assert status == 0
    assert json.loads(out)["parameters"]["cart_cell"] == [10.0, 4.0]
    for value in ("10", "10,4,2", "10,x", ","):
        assert_refused(capsys, [*both, "--set", f"cart_cell={value}"], "cart")
