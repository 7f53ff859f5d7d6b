"""The benchmarks run; for a moment each, on as little as they take."""

from pathlib import Path
import subprocess
import sys

from helpers.small_map import write_town
import pytest

FOLDER = Path(__file__).parents[1] / "benchmarks"
# Program -> arguments, and a word of what it prints.
RUNS = {
    "effects.py": (
        (
            "{drive}",
            "--rounds",
            1,
            "--frames",
            2,
            "--loads",
            1,
            "--only",
            "imu",
        ),
        "of ideal",
    ),
    "many_houses.py": (("--houses", 60), "60 houses: "),
    "ray_casting_rates.py": (("{drive}", "--rounds", 1), "Mrays/s"),
    "recording.py": (
        ("{drive}", "--rounds", 1, "--frames", 2),
        "ms a frame",
    ),
    "start.py": (("{drive}", "--runs", 2), "simulate "),
    "tcr_of_large_maps.py": (("--points", 5000), "TCR_sym"),
}
# They take minutes or a recording, need packages of the extra `benchmark`, or
# files that cannot be shipped; what they share with others is run above.
BY_HAND = {
    "any_diagram.py",
    "evaluation_of_recordings.py",
    "growth.py",
    "kills.py",
    "lidar_odometry.py",
    "memory.py",
    "peers.py",
    "real_scans.py",
    "source_rays.py",
}
SHARED = {"processes.py", "stages.py"}
# Runs a program whose new processes are forks: they import nothing anew. Their
# functions are found by name, as new interpreters find them.
FORKING = """
import multiprocessing, pickle, runpy, sys

class Fork(multiprocessing.get_context("fork").Process):
    def start(self):
        assert pickle.loads(pickle.dumps(self._target)) is self._target
        super().start()

fork = multiprocessing.get_context("fork")
fork.Process = Fork
multiprocessing.get_context = {"spawn": fork}.get
folder, *sys.argv = sys.argv[1:]
sys.path.insert(0, folder)
runpy.run_path(sys.argv[0], run_name="__main__")
"""


def test_each_benchmark_is_accounted_for():
    found = {path.name for path in FOLDER.glob("*.py")}
    assert found == RUNS.keys() | BY_HAND | SHARED


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """File of a drive through a map of a few boxes."""
    routes = {"01": "metropolis_01"}
    town = write_town(tmp_path_factory.mktemp("maps") / "town", routes, 3)
    return town / "sequence_01.yaml"


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_it_runs(name, drive):
    arguments, word = RUNS[name]
    words = [str(argument).format(drive=drive) for argument in arguments]
    done = subprocess.run(
        [sys.executable, "-c", FORKING, FOLDER, FOLDER / name, *words],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert word in done.stdout


def test_the_others_are_imported():
    """Whatever they import is still there."""
    names = sorted(Path(name).stem for name in BY_HAND - {"peers.py"})
    code = f"import sys; sys.argv = ['x']; import {', '.join(names)}"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=FOLDER,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
