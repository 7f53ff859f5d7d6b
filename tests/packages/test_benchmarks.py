"""The benchmarks run; for a moment each, on as little as they take."""

from pathlib import Path
import subprocess
import sys

import pytest

FOLDER = Path(__file__).parents[1] / "benchmarks"
# Program -> arguments, and a word of what it prints.
RUNS = {
    "ray_casting_rates.py": (("riverside_01", "--rounds", 1), "Mrays/s"),
    "recording.py": (
        ("riverside_01", "--rounds", 1, "--frames", 2),
        "ms a frame",
    ),
    "start.py": (("riverside_01", "--runs", 2), "simulate riverside_01"),
    "tcr_of_large_maps.py": (("--points", 5000), "TCR_sym"),
}
# They take minutes or a recording, need packages of the extra `benchmark`, or
# files that cannot be shipped; what they share with others is run above.
BY_HAND = {
    "any_diagram.py",
    "evaluation_of_recordings.py",
    "growth.py",
    "kills.py",
    "memory.py",
    "peers.py",
    "real_scans.py",
}
SHARED = {"processes.py", "stages.py"}


def test_each_benchmark_is_accounted_for():
    found = {path.name for path in FOLDER.glob("*.py")}
    assert found == RUNS.keys() | BY_HAND | SHARED


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_it_runs(name):
    arguments, word = RUNS[name]
    done = subprocess.run(
        [sys.executable, FOLDER / name, *map(str, arguments)],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert word in done.stdout


@pytest.mark.parametrize("name", sorted(BY_HAND - {"peers.py"}))
def test_the_others_are_imported(name):
    """Whatever they import is still there."""
    code = f"import sys; sys.argv = ['x']; import {Path(name).stem}"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=FOLDER,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
