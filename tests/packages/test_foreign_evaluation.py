"""A user's own `evaluation` neither breaks anything nor is broken."""

import os
from pathlib import Path
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]
FAILING = "raise RuntimeError('not to be imported')\n"
# What a user may have -> its files.
KINDS = {
    "package": {
        "evaluation/__init__.py": "",
        "evaluation/metrics.py": "MINE = True\n",
        "evaluation/support/__init__.py": FAILING,
    },
    "failing": {"evaluation/__init__.py": FAILING},
    "folder": {
        "evaluation/metrics.py": "MINE = True\n",
        "evaluation/support/errors.py": FAILING,
    },
    "module": {"evaluation.py": FAILING},
}
LIBRARY = """
import sys
import numpy as np
from cns_drake import InputError, Lidar, evaluation, load_scenario
from cns_drake.scene import world
assert world.InputError is InputError is evaluation.InputError
points = np.random.default_rng(1).uniform(size=(9, 3))
assert evaluation.temporal_change(points, points).symmetric == 0.0
try:
    load_scenario("nowhere_01")
except InputError:
    print("works")
"""
THEIRS = "import evaluation.metrics\nassert evaluation.metrics.MINE\n"


@pytest.fixture(params=KINDS)
def folder(request, tmp_path):
    for name, text in KINDS[request.param].items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path


def run(folder, *command):
    """Runs Python there, where the folder comes first, then this project."""
    path = os.pathsep.join([".", str(ROOT)])
    return subprocess.run(
        [sys.executable, *command],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
    )


def test_library(folder):
    script = folder / "script.py"
    script.write_text(LIBRARY)
    done = run(folder, script)
    assert (done.stdout, done.returncode) == ("works\n", 0), done.stderr


@pytest.mark.parametrize("folder", ["package", "folder"], indirect=True)
def test_theirs_after_ours(folder):
    script = folder / "script.py"
    script.write_text(LIBRARY + THEIRS)
    done = run(folder, script)
    assert (done.stdout, done.returncode) == ("works\n", 0), done.stderr


@pytest.mark.parametrize("folder", ["package"], indirect=True)
def test_theirs_before_ours(folder):
    script = folder / "script.py"
    script.write_text(THEIRS + LIBRARY + THEIRS)
    done = run(folder, script)
    assert (done.stdout, done.returncode) == ("works\n", 0), done.stderr


def test_program(folder):
    done = run(folder, "-m", "cns_drake", "list")
    assert done.returncode == 0, done.stderr
    assert "metropolis_04" in done.stdout


def test_diagram_script(folder):
    done = run(folder, ROOT / "diagrams/downtown_01.py", "--help")
    assert done.returncode == 0, done.stderr
    assert "Downtown, stage 01" in done.stdout


def test_a_program_prefers_ours(folder):
    # Also in the processes of its jobs, which get its search path.
    code = (
        "import cns_drake.__main__, evaluation, os, sys; "
        "print(os.path.dirname(os.path.dirname(evaluation.__file__))); "
        "print(cns_drake.isolation._Finder in sys.meta_path)"
    )
    done = run(folder, "-c", code)
    assert done.stdout.splitlines() == [str(ROOT), "False"], done.stderr
