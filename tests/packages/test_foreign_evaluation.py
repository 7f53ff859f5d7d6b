"""A user's own `evaluation` neither breaks anything nor is broken."""

import os
from pathlib import Path
import subprocess
import sys

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
FAILING = "raise RuntimeError('not to be imported')\n"
# What a user may have -> its files.
KINDS = {
    "package": {
        "evaluation/__init__.py": "",
        "evaluation/metrics.py": "MINE = True\n",
        "cns_drake/base/__init__.py": FAILING,
    },
    "failing": {"evaluation/__init__.py": FAILING},
    "folder": {
        "evaluation/metrics.py": "MINE = True\n",
        "cns_drake/base/errors.py": FAILING,
    },
    "module": {"evaluation.py": FAILING},
}
HIDING = ("evaluation.py", "evaluation/__init__.py")
LIBRARY = """
import sys
from cns_drake import InputError, Lidar, add_lidar, load_scenario
try:
    load_scenario("nowhere_01")
except InputError:
    print("works")
"""
STUDY = """
from cns_drake import InputError
try:
    import cns_drake.studies
except InputError as error:
    print(error)
"""
THEIRS = "import evaluation.metrics\nassert evaluation.metrics.MINE\n"


# What neither can be imported nor hides a package is left to the night.
@pytest.fixture(
    params=[
        "package",
        pytest.param("failing", marks=pytest.mark.night),
        "folder",
        pytest.param("module", marks=pytest.mark.night),
    ]
)
def folder(request, tmp_path):
    for name, text in KINDS[request.param].items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path


def run(folder, *command, path=()):
    """Runs Python there; `path` comes before this project."""
    return subprocess.run(
        [sys.executable, *command],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([*path, str(ROOT)])},
        capture_output=True,
        text=True,
    )


def run_script(folder, text):
    """Runs a script that lies there; Python puts its folder first."""
    (folder / "script.py").write_text(text)
    return run(folder, "script.py")


def test_the_simulator_never_loads_an_evaluation_and_a_study_names_it(folder):
    """A folder that is no package hides nothing."""
    unloaded = "assert 'evaluation' not in sys.modules\n"
    done = run_script(folder, LIBRARY + unloaded + STUDY)
    assert done.returncode == 0, done.stderr
    works, *lines = done.stdout.splitlines()
    assert works == "works"
    assert len(lines) == any((folder / f).is_file() for f in HIDING)
    for line in lines:
        assert line.startswith(f"{folder}/evaluation"), done.stderr
        assert "hides the package of that name" in line


@pytest.mark.parametrize("folder", ["package"], indirect=True)
def test_the_user_keeps_theirs(folder):
    done = run_script(folder, THEIRS + LIBRARY + THEIRS)
    assert (done.stdout, done.returncode) == ("works\n", 0), done.stderr


def test_a_program_leaves_out_the_current_folder(folder):
    """Python adds it twice: for `-m`, and by its name."""
    done = run(folder, "-m", "cns_drake", "list", path=["."])
    assert done.returncode == 0, done.stderr
    assert "metropolis_04" in done.stdout


@pytest.mark.parametrize("folder", ["failing"], indirect=True)
def test_diagram_script(folder):
    done = run(folder, ROOT / "diagrams/downtown_01.py", "--help")
    assert done.returncode == 0, done.stderr
    assert "Downtown, stage 01" in done.stdout


@pytest.mark.parametrize(
    "folder", ["package", "failing", "module"], indirect=True
)
def test_a_program_names_what_hides_its_evaluation(folder, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    # As the script that pip makes of the entry point.
    script = "from cns_drake.__main__ import evaluate; evaluate()"
    for program, command in (
        ("cns-drake", ("-m", "cns_drake", "list")),
        ("cns-eval", ("-c", script, "--help")),
    ):
        done = run(elsewhere, *command, path=[str(folder)])
        assert (done.stdout, done.returncode) == ("", 2)
        (line,) = done.stderr.splitlines()
        assert line.startswith(f"{program}: error: {folder}/evaluation")
