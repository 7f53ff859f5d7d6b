"""The benchmarks run; for a moment each, on as little as they take."""

import json
from pathlib import Path
import subprocess
import sys

from helpers.small_map import write_town
import pytest

FOLDER = Path(__file__).parents[1] / "benchmarks"
# Program -> arguments, and a word of what it prints.
RUNS = {
    "many_houses.py": (("--houses", 16), "16 houses: "),
    "many_places.py": (
        ("--methods", "solid", "--places", 5, 10, "--queries", 2),
        "time of a query ~ places",
    ),
    "ray_casting_rates.py": (("{drive}", "--rounds", 1), "Mrays/s"),
    "recording.py": (
        ("{drive}", "--rounds", 1, "--frames", 2),
        "ms a frame",
    ),
}
# They take minutes or a recording, need packages of the extra `benchmark`, or
# files that cannot be shipped; what they share with others is run above.
BY_HAND = {
    "any_diagram.py",
    "interruptions.py",
    "interval_coverage.py",
    "lidar_odometry.py",
    "network_verdicts.py",
    "peers.py",
    "predicts_failure.py",
    "real_or_simulated.py",
    "repeats.py",
    "source_rays.py",
    "street_blocks.py",
    "table1_sources.py",
}
SHARED = {"processes.py", "stages.py"}
# A process that imports what benchmarks need, and forks for each one. Their own
# new processes are forks, too: they import nothing anew. Functions are found by
# name, as new interpreters find them.
FORKING = """
import gc, importlib, json, multiprocessing, os, pickle, runpy, sys

class Fork(multiprocessing.get_context("fork").Process):
    def start(self):
        assert pickle.loads(pickle.dumps(self._target)) is self._target
        super().start()

fork = multiprocessing.get_context("fork")
fork.Process = Fork
multiprocessing.get_context = {"spawn": fork}.get
folder, *modules = sys.argv[1:]
sys.path.insert(0, folder)
for module in modules:
    importlib.import_module(module)
sys.modules["evaluation.base.compilation"].start_compiler()
gc.freeze()
for line in sys.stdin:
    *outputs, words = json.loads(line)
    if os.fork() == 0:
        for number, output in enumerate(outputs, start=1):
            with open(output, "w") as printed:
                os.dup2(printed.fileno(), number)
        sys.argv = words
        runpy.run_path(words[0], run_name="__main__")
        sys.exit()
    print(os.waitstatus_to_exitcode(os.wait()[1]), flush=True)
"""
# They import most of the rest.
IMPORTED = (
    "cns_drake.simulation.simulation",
    "cns_drake.command_line.cli",
    "evaluation.drives",
    "stages",
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
def forking():
    with subprocess.Popen(
        [sys.executable, "-c", FORKING, FOLDER, *IMPORTED],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        yield process


def run(forking, folder, *words):
    """Runs a program with its arguments; returns what it prints."""
    printed, errors = folder / "printed", folder / "errors"
    line = json.dumps([str(printed), str(errors), [str(one) for one in words]])
    print(line, file=forking.stdin, flush=True)
    status = forking.stdout.readline()
    assert status == "0\n", errors.read_text()
    return printed.read_text()


@pytest.mark.night
@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_it_runs(name, drive, forking, tmp_path):
    arguments, word = RUNS[name]
    words = [str(argument).format(drive=drive) for argument in arguments]
    assert word in run(forking, tmp_path, FOLDER / name, *words)


@pytest.mark.night
@pytest.mark.slow
def test_the_others_are_imported(forking, tmp_path):
    """Whatever they import is still there."""
    names = sorted(Path(name).stem for name in BY_HAND - {"peers.py"})
    program = tmp_path / "program.py"
    program.write_text(f"import {', '.join(names)}\nprint('all')")
    assert run(forking, tmp_path, program) == "all\n"
