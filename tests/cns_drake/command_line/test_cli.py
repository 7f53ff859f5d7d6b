"""The command line: results, exit status, and one line for every fault."""

import re
import subprocess
import sys

from helpers.documents import ROOT
from helpers.internal.eval_program import run_program
from helpers.small_map import box_visual, scenario_values, world_text
import numpy as np
import pytest
import yaml

from cns_drake.__main__ import main
from cns_drake.command_line import run_script
from worlds.maps import recordable_drives

pytestmark = pytest.mark.slow

DIAGRAMS = ROOT / "diagrams"
POSE = ["--pose", "0", "0", "1.6", "0", "0", "-0.5"]


def run(*arguments, script=None):
    command = [sys.executable, *(["-m", "cns_drake"] if not script else [])]
    command += [str(script)] if script else []
    return subprocess.run(
        [*command, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
    )


def run_here(capfd, *arguments):
    """Like `run`, in this process, which has loaded everything already."""
    result = run_program(capfd, "cns-drake", main, *arguments)
    return subprocess.CompletedProcess(arguments, *result)


@pytest.fixture(scope="module")
def files(tmp_path_factory, small_map):
    """Input of all kinds, good and bad."""
    folder = tmp_path_factory.mktemp("files")
    wall = box_visual("wall", (8, 0, 2, 0, 0, 0), (1, 40, 4))
    (folder / "good.sdf").write_text(world_text([wall]))
    values = scenario_values(small_map) | {"frames": 3}
    for name, change in [
        ("drive", {}),
        ("typo", {"stge": "04"}),
        ("long", {"frames": 10**7}),
    ]:
        text = yaml.safe_dump(values | {"name": name} | change)
        (folder / f"{name}.yaml").write_text(text)
    (folder / "file").write_text("")
    return folder


def test_list_names_the_drives():
    result = run("list")
    assert result.returncode == 0
    assert "metropolis_01" in result.stdout
    # A slow machine may say what it does.
    assert "error" not in result.stderr


def test_no_arguments_show_the_help():
    result = run()
    assert result.returncode == 0
    for command in ("list", "simulate", "generate", "export", "scan"):
        assert command in result.stdout


def test_simulate_and_overwrite(files, tmp_path, capfd):
    arguments = ("simulate", files / "drive.yaml", "--output", tmp_path)
    result = run_here(capfd, *arguments)
    assert result.returncode == 0
    assert "3 frames" in result.stdout
    assert (tmp_path / "drive" / "metadata.yaml").is_file()
    assert "real time" in result.stdout
    again = run_here(capfd, *arguments)
    assert again.returncode == 2
    assert_one_line(again, "drive")
    shorter = run_here(capfd, *arguments, "--overwrite", "--frames", 2)
    assert shorter.returncode == 0


def test_options_change_the_fields_of_the_drive(files, tmp_path, capfd):
    drive = ("simulate", files / "drive.yaml", "--output", tmp_path)
    varied = ("--ride", "B", "--imu-rate", 400, "--frames", 2, "--rain", 5)
    varied += ("--transient", "leaves=0.5,seed=3")
    assert run_here(capfd, *drive, *varied).returncode == 0
    recorded = (tmp_path / "drive" / "scenario.yaml").read_text()
    values = yaml.safe_load(recorded)
    assert values["ride"] == {"roughness": "B", "seed": 1}
    assert values["imu"]["rate"] == 400
    assert values["weather"]["rain"] == 5
    assert values["lidars"]["lidar"]["returns"] == "calibrated"
    assert values["transient"]["leaves"] == 0.5
    refused = run_here(capfd, *drive, "--imu-rate", 333)
    assert_one_line(refused, "--imu-rate: imu: rate: 333 a second")


def test_scan(files, tmp_path, capfd):
    output = tmp_path / "scan.npy"
    result = run_here(
        capfd,
        "scan",
        files / "good.sdf",
        *POSE,
        "--output",
        output,
        "--lidar",
        "vlp-16",
    )
    assert result.returncode == 0
    points = np.load(output)
    assert f"{len(points)} points" in result.stdout
    # The wall's face at x = 7.5, seen from a sensor turned by -0.5 rad.
    x_W = np.cos(-0.5) * points[:, 0] - np.sin(-0.5) * points[:, 1]
    assert np.abs(x_W - 7.5).min() < 1e-5


def test_scan_with_calibrated_returns(files, tmp_path, capfd):
    scans = {}
    for name, words in {
        "first": ("--returns", "calibrated", "--seed", 3),
        "again": ("--returns", "calibrated", "--seed", 3),
        "other": ("--returns", "calibrated", "--seed", 4),
        "fog": ("--fog", 30, "--seed", 3),
    }.items():
        path = tmp_path / f"{name}.npy"
        words = (*POSE, "--output", path, "--lidar", "vlp-16", *words)
        result = run_here(capfd, "scan", files / "good.sdf", *words)
        assert result.returncode == 0
        scans[name] = np.load(path)
    assert scans["first"].tobytes() == scans["again"].tobytes()
    assert scans["first"].tobytes() != scans["other"].tobytes()
    assert len(scans["fog"]) != len(scans["first"])
    # Calibrated reflectivity in whole numbers.
    intensity = scans["first"][:, 3]
    assert intensity.max() > 1.0
    np.testing.assert_array_equal(intensity, np.rint(intensity))


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (("--fog", 2), "--fog: "),
        (("--rain", -1), "--rain: "),
        (("--returns", "ideal", "--rain", 1), "--returns ideal: weather"),
    ],
)
def test_weather_that_cannot_be(files, tmp_path, capfd, words, fault):
    output = ("--output", tmp_path / "a.npy")
    good = files / "good.sdf"
    result = run_here(capfd, "scan", good, *POSE, *output, *words)
    assert result.returncode == 2
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"cns-drake: error: {fault}")


def test_diagram_script_has_options():
    """Where the documents run one, `test_recipes` does."""
    shown = run("--help", script=DIAGRAMS / "metropolis_04.py")
    assert shown.returncode == 0
    options = ("frames", "output", "lidar", "traffic", "recording", "graphviz")
    for option in options:
        assert f"--{option}" in shown.stdout
    assert shown.stdout.startswith("Usage: metropolis_04.py [OPTIONS]")


def test_diagram_script_records_and_makes_a_page(files, tmp_path, capfd):
    page = tmp_path / "drive.html"
    page.write_text("An older page.")  # It is replaced, as the help says.
    status, out, err = run_program(
        capfd,
        "a.py",
        lambda: run_script(str(files / "drive.yaml"), "A drive."),
        "--frames",
        2,
        "--output",
        tmp_path,
        "--recording",
        page,
    )
    assert status == 0
    assert "2 frames" in out
    assert (tmp_path / "drive" / "metadata.yaml").is_file()
    assert page.stat().st_size > 100_000
    assert f"wrote {page}" in err


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (["simulate", "atlantis_01"], "unknown drive 'atlantis_01'"),
        (["simulate", "riverside"], "riverside: a map; .*: riverside_01, "),
        (["simulate", "{files}"], "a folder without a drive"),
        (["simulate", "{files}/none.yaml"], "none.yaml: no such"),
        (["simulate", "{files}/typo.yaml"], "typo.yaml: stge: "),
        (["simulate", "{files}/long.yaml"], "frames: 10000000"),
        (["simulate", "{files}/drive.yaml", "--lidar", "x"], "--lidar: .*'x'"),
        (["simulate", "{files}/drive.yaml", "--bogus"], "--bogus"),
        (["simulate", "{files}/drive.yaml", "--camera", "6x4@2 "], "WxH@RATE"),
        (
            ["film", "{files}/drive.yaml", "--size", "64"],
            "--size: '64'",
        ),
        (
            ["film", "{files}/drive.yaml", "--start-time", "1e6"],
            "--start-time: 1e.06 s: ",
        ),
        (
            ["scan", "{files}/good.sdf", "--pose", *"00000", "nan"],
            "--pose: not finite",
        ),
        (
            ["simulate", "{files}/drive.yaml", "--recording", "page.txt"],
            "--recording: page.txt does not end in .html",
        ),
        (["reproduce", "atlantis"], "unknown map 'atlantis'"),
        (["study"], "study: give an experiment, or --list"),
        (["study", "war"], "war: neither an experiment of this package"),
        (
            ["study", "ladder", "--set", "foo=3"],
            "^cns-drake: error: --set: foo: E",
        ),
        (["study", "ladder", "--set", "levels"], "'levels' is not FIELD=VALUE"),
        (
            ["reproduce", "--no-recordings", "--pages"],
            "--no-recordings and --pages exclude each other",
        ),
        (["teleport"], "teleport"),
        (["simulat"], r"did you mean simulate\?"),
        (
            ["simulate", "{files}/drive.yaml", "--lidar", "os1_64"],
            "mean os1-64\\?",
        ),
        (["study", "ladder", "--method", "ring+++"], "mean ring\\+\\+\\?"),
        (["study", "ladder", "--task", "plaec"], "mean place\\?"),
    ],
)
def test_faults_are_one_line(files, tmp_path, capfd, arguments, fault):
    output = tmp_path / "output"
    if arguments[0] in ("film", "scan"):
        output = tmp_path / {"film": "a.webp", "scan": "a.bin"}[arguments[0]]
    arguments = [a.format(files=files) for a in arguments]
    result = run_here(capfd, *arguments, "--output", output)
    assert_one_line(result, fault)
    assert not output.exists()


@pytest.mark.parametrize(
    "arguments", [["age", "suburbia", "--years", "1"], ["import", "a.xodr"]]
)
def test_the_name_of_a_new_map(tmp_path, capfd, arguments):
    result = run_here(capfd, *arguments, "--output", tmp_path / "my town")
    assert_one_line(result, "--output: 'my town': the folder's name may have")


@pytest.mark.parametrize("command", ["simulate", "film", "scan", "generate"])
def test_output_that_cannot_be_written(files, capfd, command):
    arguments = {
        "simulate": ["simulate", files / "drive.yaml"],
        "film": ["film", files / "drive.yaml"],
        "scan": ["scan", files / "good.sdf", *POSE],
        "generate": ["generate", files / "drive.yaml"],
    }[command]
    ending = ".webp" if command == "film" else ".bin"
    output = files / "file" / f"below{ending}"
    result = run_here(capfd, *arguments, "--output", output)
    assert_one_line(result, r"file(/[\w./]+)?: \w+")


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (["{files}/none"], "none/roads.yaml: "),
        (["{files}", "--seed", "-1"], "--seed"),
    ],
)
def test_faults_of_city_are_one_line(files, capfd, arguments, fault):
    before = sorted(files.iterdir())
    words = (a.format(files=files) for a in arguments)
    result = run_here(capfd, "city", *words)
    assert_one_line(result, fault)
    assert sorted(files.iterdir()) == before


def assert_one_line(result, fault):
    assert result.returncode == 2, result.stderr
    assert result.stdout == ""
    last = result.stderr.strip().splitlines()[-1]
    assert last.startswith("cns-drake: error: ")
    assert re.search(fault, last), last
    assert "Traceback" not in result.stderr
    # Only progress may come before it.
    errors = [line for line in result.stderr.splitlines() if "error" in line]
    assert errors == [last]


def test_every_drive_has_a_script_that_names_it():
    scripts = {
        path.stem: path.read_text()
        for path in DIAGRAMS.glob("*.py")
        if "run_script" in path.read_text()
    }
    assert scripts.keys() == recordable_drives().keys()
    for name, text in scripts.items():
        assert f'run_script("{name}", __doc__)' in text
