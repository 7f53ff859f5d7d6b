import csv
import json
from pathlib import Path
import re
import subprocess
import sys

from drive_files import make_scan, write_recording, yaw_pose
import numpy as np
import pytest

from evaluation import cli
from evaluation.methods import method


def make_block_scene(seed):
    rng = np.random.default_rng([seed, 5])
    parts = []
    for _ in range(40):
        foot = rng.uniform(-60.0, 60.0, 2)
        size = [*rng.uniform(1.0, 8.0, 2), rng.uniform(2.0, 20.0)]
        parts.append(
            rng.uniform(size=(150, 3)) * size + np.array([*foot, -1.6])
        )
    return np.concatenate(parts)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """Two drives of eight frames, 10 m apart; folders of their scans."""
    folder = tmp_path_factory.mktemp("data")
    for name, side in (("town_01", 0.0), ("town_02", 1.0)):
        scans = [make_block_scene(i) - [0.0, side, 0.0] for i in range(8)]
        write_recording(
            folder / name,
            [make_scan(scan) for scan in scans],
            [yaw_pose(10.0 * i, side, 0.0, 0.0) for i in range(8)],
        )
        singles = folder / f"{name}_scans"
        singles.mkdir()
        for i, scan in enumerate(scans[:4]):
            four = np.c_[scan, np.ones(len(scan))].astype(np.float32)
            four.tofile(singles / f"{i:06d}.bin")
        np.save(folder / f"{name}.npy", np.concatenate(scans))
    return folder


def run(capsys, *arguments):
    """Runs the program in this process; returns status, stdout, stderr."""
    old = sys.argv
    sys.argv = ["cns-eval", *map(str, arguments)]
    try:
        with pytest.raises(SystemExit) as info:
            cli.main()
    finally:
        sys.argv = old
    out, err = capsys.readouterr()
    return info.value.code, out, err


def assert_refused(capsys, arguments, *words):
    status, out, err = run(capsys, *arguments)
    assert status == 2
    assert out == ""
    assert err.startswith("cns-eval: error: ")
    assert err.count("\n") == 1
    for word in words:
        assert str(word) in err


def test_tcr_json(capsys, data):
    status, out, err = run(
        capsys, "tcr", data / "town_01", data / "town_02", "--json"
    )
    values = json.loads(out)
    assert status == 0
    assert err == ""
    assert {
        "tcr_sym",
        "tcr_source_to_target",
        "tcr_target_to_source",
        "in_hull",
        "unchanged",
    } <= values.keys()
    assert 0.0 <= values["tcr_sym"] < 0.05
    assert values["in_hull"] > 100


def test_tcr_of_itself_by_any_path(capsys, data):
    for path in (
        data / "town_01",
        data / "town_01" / "town_01_0.mcap",
        data / "town_01.npy",
    ):
        _, out, _ = run(capsys, "tcr", path, path, "--json")
        assert json.loads(out)["tcr_sym"] == 0.0


def test_tcr_table(capsys, data):
    a, b = data / "town_01", data / "town_02"
    status, out, _ = run(capsys, "tcr", a, b, "--control", a)
    assert status == 0
    for text in (
        "town_01 <-> town_02",
        "TCR_sym ",
        "TCR town_02 -> town_01",
        "where both drove",
        "routes alone",
    ):
        assert text in out


def test_tcr_undefined_is_null_with_a_reason(capsys, data, tmp_path):
    np.save(tmp_path / "empty.npy", np.empty((0, 3)))
    arguments = ("tcr", data / "town_01.npy", tmp_path / "empty.npy")
    status, out, _ = run(capsys, *arguments, "--json")
    assert status == 0
    values = json.loads(out)
    assert values["tcr_sym"] is None
    assert values["reason"]
    status, out, _ = run(capsys, *arguments)
    assert status == 0
    assert "undefined" in out


def test_tcr_tells_of_points_that_are_not_finite(capsys, data, tmp_path):
    points = np.load(data / "town_01.npy")
    points[3] = np.nan
    np.save(tmp_path / "a.npy", points)
    status, _, err = run(capsys, "tcr", tmp_path / "a.npy", tmp_path / "a.npy")
    assert status == 0
    assert "a.npy: 1 points not finite" in err


def test_pr_json(capsys, data):
    status, out, err = run(
        capsys,
        "pr",
        data / "town_01",
        data / "town_02",
        "--method",
        "scan-context++",
        "--json",
    )
    assert status == 0
    assert err == ""
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
    # Every scene is another; the side step of 1 m hides none of them.
    assert values["recall_at_1"] == values["auc"] == 1.0
    assert values["true_positives"] == values["queries"] == 8


def test_pr_table_modes_and_parameters(capsys, data):
    arguments = (
        "pr",
        data / "town_01",
        data / "town_02",
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
    for text in ("filtered", "R@1 ", "TP 8 of N 8", "AUC", "F1max", "R@1%"):
        assert text in out
    _, out, _ = run(capsys, *arguments, "--json")
    parameters = json.loads(out)["parameters"]
    assert parameters["variant"] == "polar"
    assert parameters["candidates"] == 3
    assert parameters["sensor_height"] == 1.8


def test_scores_of_all_pairs(capsys, data, tmp_path):
    output = tmp_path / "scores.csv"
    status, out, err = run(
        capsys,
        "scores",
        "--method",
        "scan-context++",
        "--database",
        data / "town_01_scans",
        "--query",
        data / "town_02_scans",
        "--output",
        output,
    )
    assert (status, out) == (0, "")
    assert str(output) in err
    with output.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    names = [f"{i:06d}" for i in range(4)]
    assert [(r["query"], r["database"]) for r in rows] == [
        (q, d) for q in names for d in names
    ]
    scores = np.array([float(r["score"]) for r in rows]).reshape(4, 4)
    assert scores.argmax(axis=1).tolist() == [0, 1, 2, 3]
    assert not list(tmp_path.glob("*.part"))


def test_help_is_instant_and_modules_stay_apart():
    # A time is no test; what is imported is.
    code = (
        "import sys; sys.argv = ['cns-eval', '--help']\n"
        "from evaluation import cli\n"
        "try: cli.main()\n"
        "except SystemExit as e: assert not e.code, e.code\n"
        "heavy = {'numpy', 'scipy', 'numba', 'matplotlib', 'mcap', 'rosbags',"
        " 'pydrake', 'cns_drake', 'open3d'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    for command in ("tcr", "pr", "scores", "report"):
        assert command in done.stdout


def test_nothing_imports_the_simulator():
    code = (
        "import pkgutil, importlib, sys, evaluation\n"
        "for m in pkgutil.walk_packages(evaluation.__path__, 'evaluation.'):\n"
        "    if not m.name.endswith('__main__'):\n"
        "        importlib.import_module(m.name)\n"
        "assert not {'pydrake', 'cns_drake', 'open3d'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_module_is_the_program(data):
    done = subprocess.run(
        [sys.executable, "-m", "evaluation", "tcr", "nowhere", "nowhere"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2
    assert done.stderr == ("cns-eval: error: nowhere: no such file or folder\n")


def readme_method(folder):
    """Saves the method that the README shows, as a file of a name."""
    readme = Path(__file__).parents[1] / "README.md"
    blocks = re.findall(
        r"^```python\n(.*?)^```",
        readme.read_text(encoding="utf-8"),
        re.DOTALL | re.MULTILINE,
    )
    (example,) = (block for block in blocks if "@register" in block)
    path = folder / "readme_heights.py"
    path.write_text(example, encoding="utf-8")
    return path


def test_the_method_in_the_readme(capsys, data, tmp_path, monkeypatch):
    # Others need not know of it.
    monkeypatch.setattr(method, "_METHODS", dict(method._METHODS))
    path = readme_method(tmp_path)
    assert len(path.read_text().splitlines()) < 30
    both = ["pr", data / "town_01", data / "town_02", "--method", path]
    status, out, _ = run(capsys, *both, "--set", "rings=30", "--json")
    assert status == 0
    values = json.loads(out)
    assert values["method"] == "heights"
    assert values["parameters"] == {"sensor_height": 1.6, "rings": 30}
    assert values["recall_at_1"] > 0.8
    assert_refused(capsys, [*both, "--set", "rings=x"], "heights: rings")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("x = ", "SyntaxError"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("x = 1", "registers 0 methods"),
        (
            "from evaluation.methods import Method, register\n"
            "register('btc')(type('A', (Method,), {}))",
            "there is another method 'btc'",
        ),
    ],
)
def test_files_that_are_no_method(capsys, data, tmp_path, text, fault):
    path = tmp_path / "no_method.py"
    path.write_text(text)
    both = ["pr", data / "town_01", data / "town_02", "--method"]
    assert_refused(capsys, [*both, path], path, fault)
    nowhere = tmp_path / "nowhere.py"
    assert_refused(capsys, [*both, nowhere], nowhere, "no such file")


def test_parameters_of_several_numbers(capsys, data):
    both = ["pr", data / "town_01", data / "town_02", "--json"]
    both += ["--method", "scan-context++", "--set", "variant=cart"]
    status, out, _ = run(capsys, *both, "--set", "cart_cell=10,4")
    assert status == 0
    assert json.loads(out)["parameters"]["cart_cell"] == [10.0, 4.0]
    for value in ("10", "10,4,2", "10,x", ","):
        assert_refused(capsys, [*both, "--set", f"cart_cell={value}"], "cart")


def test_bad_usage(capsys, data):
    town = data / "town_01"
    assert_refused(capsys, ["evaluate"], "No such command 'evaluate'")
    assert_refused(capsys, ["tcr", town], "Missing argument 'B'")
    assert_refused(capsys, ["tcr", town, town, "--colour"], "--colour")
    assert_refused(capsys, ["pr", town, town], "Missing option '--method'")
    pr = ["pr", town, town, "--method"]
    assert_refused(capsys, [*pr, "bow"], "'bow'", "known: ", "scan-context++")
    pr.append("scan-context++")
    assert_refused(capsys, [*pr, "--mode", "some"], "some", "filtered")
    assert_refused(capsys, [*pr, "--set", "candidates"], "is not NAME=VALUE")
    assert_refused(capsys, [*pr, "--set", "x=1"], "no parameter 'x'")
    assert_refused(capsys, [*pr, "--set", "rings=many"], "rings")
    for height in ("nan", "inf", "-1.6"):
        assert_refused(
            capsys, [*pr, f"--sensor-height={height}"], "sensor_height"
        )


def test_bad_input(capsys, data, tmp_path):
    town = data / "town_01"
    cut = tmp_path / "cut.mcap"
    whole = (town / "town_01_0.mcap").read_bytes()
    cut.write_bytes(whole[: len(whole) // 2])
    assert_refused(capsys, ["tcr", town, cut], cut, "cut off")
    empty = tmp_path / "empty"
    empty.mkdir()
    assert_refused(capsys, ["tcr", empty, town], empty, "not a recorded")
    short = tmp_path / "short.bin"
    short.write_bytes(b"12345")
    assert_refused(capsys, ["tcr", short, short], short, "5 bytes")
    assert_refused(
        capsys,
        ["pr", town, data / "town_01.npy", "--method", "scan-context++"],
        "town_01.npy",
        "not a recorded sequence",
    )


def test_points_that_are_not_finite_are_told(capsys, data, tmp_path):
    scan = make_scan(make_block_scene(0))
    scan["y"][:7] = np.nan
    write_recording(tmp_path / "holes", [scan], [yaw_pose(0.0, 0.0, 0.0, 0.0)])
    town = data / "town_01"
    status, _, err = run(capsys, "tcr", town, tmp_path / "holes")
    assert status == 0
    assert err == "holes: 7 points not finite\n"
    (tmp_path / "scans").mkdir()
    np.save(
        tmp_path / "scans" / "a.npy",
        np.stack([scan[axis] for axis in "xyz"], axis=1),
    )
    folders = ["--database", tmp_path / "scans", "--query", tmp_path / "scans"]
    output = tmp_path / "scores.csv"
    scores = ["scores", "--method", "solid", *folders, "--output", output]
    status, _, err = run(capsys, *scores)
    assert status == 0
    assert err.startswith("14 points not finite\n")
    (row,) = csv.DictReader(output.open())
    assert float(row["score"]) == pytest.approx(1.0, abs=1e-12)


def test_poses_out_of_this_world(capsys, data, tmp_path):
    scan = make_scan(make_block_scene(0))
    write_recording(tmp_path / "lost", [scan], [yaw_pose(1e9, 0.0, 0.0, 0.0)])
    for command in (["tcr"], ["pr", "--method", "solid"]):
        lost = [*command, data / "town_01", tmp_path / "lost"]
        assert_refused(capsys, lost, "lost_0.mcap: a pose is 1e+09 m from")


def test_parameters_that_need_too_much_memory(capsys, data):
    town = data / "town_01"
    large = ["pr", town, town, "--method", "scan-context++"]
    large += ["--set", "rings=10000000000000"]
    assert_refused(capsys, large, "not enough memory")


def test_bad_folders_of_scans(capsys, data, tmp_path):
    good = data / "town_01_scans"

    def scores(database, query, output=tmp_path / "out.csv"):
        return [
            "scores",
            "--method",
            "scan-context++",
            "--database",
            database,
            "--query",
            query,
            "--output",
            output,
        ]

    empty = tmp_path / "empty"
    empty.mkdir()
    assert_refused(capsys, scores(empty, good), empty, "no scan in it")
    assert_refused(
        capsys, scores(good, tmp_path / "none"), "none", "no such folder"
    )
    twice = tmp_path / "twice"
    twice.mkdir()
    for name in ("a.bin", "a.npy"):
        (twice / name).write_bytes(b"")
    assert_refused(capsys, scores(twice, good), "a.npy", "same name")
    far = tmp_path / "far"
    far.mkdir()
    np.save(far / "a.npy", np.full((10, 3), 300.0))
    assert_refused(capsys, scores(good, far), "a.npy", "no finite point")
    void = tmp_path / "void"
    void.mkdir()
    (void / "a.bin").write_bytes(b"")
    assert_refused(capsys, scores(good, void), "a.bin", "no finite point")
    noise = tmp_path / "noise"
    noise.mkdir()
    junk = np.random.default_rng(9).bytes(1600)
    (noise / "a.bin").write_bytes(junk)
    assert_refused(capsys, scores(good, noise), "a.bin", "point", "is at")
    assert not (tmp_path / "out.csv").exists()
    assert not (tmp_path / "out.csv.part").exists()
    blocked = tmp_path / "a file" / "out.csv"
    blocked.parent.write_text("")
    assert_refused(capsys, scores(good, good, blocked), blocked)
