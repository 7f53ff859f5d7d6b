"""An import that is interrupted or killed leaves no leftovers."""

import os
from pathlib import Path
import signal
import subprocess
import sys

from helpers.small_osm import write_corner
import pytest
from typer.testing import CliRunner

from cns_drake.command_line import app

# The program, which says at once what it does, however short it takes.
PROGRAM = """
import sys
from evaluation.base import program
from evaluation.base.progress import Listener, heard_by
from cns_drake.command_line.cli import app

class Printing(Listener):
    def doing(self, activity, done=0, total=0, unit=""):
        print(activity, file=sys.stderr, flush=True)

program.run(app, "cns-drake", heard_by(Printing()))
"""


def start(source, output):
    return subprocess.Popen(
        [
            sys.executable,
            "-c",
            PROGRAM,
            "import",
            str(source),
            "--output",
            str(output),
        ],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def await_word(process, word):
    # Without Python's buffer, a line may stand behind the start of another one.
    while word not in (read := process.stderr.readline()):
        assert read, f"{word} is never written"


def contents(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    "line", [pytest.param("dressing", marks=pytest.mark.night), "writing"]
)
def test_an_interrupted_import_leaves_nothing(tmp_path, line):
    write_corner(tmp_path / "city.osm")
    process = start(tmp_path / "city.osm", tmp_path / "town")
    await_word(process, line)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=600)
    assert process.returncode == 130
    assert errors.endswith("cns-drake: interrupted\n")
    assert [path.name for path in Path(tmp_path).iterdir()] == ["city.osm"]


@pytest.mark.night
@pytest.mark.slow
@pytest.mark.parametrize(
    "line",
    [
        pytest.param("reading", marks=pytest.mark.night),
        pytest.param("dressing", marks=pytest.mark.night),
        "writing",
    ],
)
def test_an_import_after_a_killed_one_succeeds(tmp_path, line):
    write_corner(tmp_path / "city.osm")
    output = tmp_path / "town"
    process = start(tmp_path / "city.osm", output)
    await_word(process, line)
    process.kill()
    process.communicate(timeout=600)
    assert process.returncode == -signal.SIGKILL
    left = {path.name for path in tmp_path.iterdir()}
    assert all(name.startswith(".town.") for name in left - {"city.osm"})
    again = ["import", str(tmp_path / "city.osm"), "--output", str(output)]
    done = CliRunner().invoke(app, again)
    assert done.exit_code == 0, done.output
    assert {path.name for path in tmp_path.iterdir()} == {"city.osm", "town"}
    assert len(contents(output)) > 10
