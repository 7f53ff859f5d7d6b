"""The benchmarks run; for a moment each, on as little as they take."""

from pathlib import Path

from helpers.forking import ForkingPython
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
    "real_or_simulated.py",
    "real_scans.py",
    "scans_to_judge.py",
    "source_rays.py",
}
SHARED = {"processes.py", "stages.py"}
# It compiles all loops anew, to see how long that takes.
BY_NIGHT = {"start.py"}
# Their own new processes are forks, too, which import nothing anew. Functions
# are found by name, as new interpreters find them.
FORKS = """
import multiprocessing, pickle

class Fork(multiprocessing.get_context("fork").Process):
    def start(self):
        assert pickle.loads(pickle.dumps(self._target)) is self._target
        super().start()

fork = multiprocessing.get_context("fork")
fork.Process = Fork
multiprocessing.get_context = {"spawn": fork}.get
"""
# They import most of the rest.
IMPORTED = (
    "cns_drake.simulation.simulation",
    "cns_drake.command_line.simulating",
    "evaluation.drives",
)


def test_each_benchmark_is_accounted_for():
    found = {path.name for path in FOLDER.glob("*.py")}
    assert found == RUNS.keys() | BY_HAND | SHARED


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """File of a drive through a map of a few boxes."""
    routes = {"01": "metropolis_01"}
    town = write_town(tmp_path_factory.mktemp("maps") / "town", routes, 3)
    return town / "sequence_01.yaml"


@pytest.fixture(scope="module")
def forking(tmp_path_factory):
    folder = tmp_path_factory.mktemp("forking")
    python = ForkingPython(folder, IMPORTED, FORKS, [FOLDER])
    yield python
    python.close()


def run(forking, folder, *words):
    """Runs a program with its arguments; returns what it prints."""
    done = forking.run(words, folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.night if name in BY_NIGHT else ())
        for name in RUNS
    ],
)
def test_it_runs(name, drive, forking, tmp_path):
    arguments, word = RUNS[name]
    words = [str(argument).format(drive=drive) for argument in arguments]
    assert word in run(forking, tmp_path, FOLDER / name, *words)


@pytest.mark.slow
def test_the_others_are_imported(forking, tmp_path):
    """Whatever they import is still there."""
    found = (BY_HAND | BY_NIGHT) - {"peers.py"}
    names = sorted(Path(name).stem for name in found)
    program = tmp_path / "program.py"
    program.write_text(f"import {', '.join(names)}\nprint('all')")
    assert run(forking, tmp_path, program) == "all\n"
