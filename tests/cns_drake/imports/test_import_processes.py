"""Imports by one process and by several: the same bytes, and no leftovers."""

import os
from pathlib import Path
import signal
import subprocess
import sys

from helpers.small_cityjson import write_blocks
from helpers.small_osm import write_corner
import pytest

# A test's process has threads, beside which nothing is forked. The number of
# processes is the first argument.
PROGRAM = """
import os
import sys
from cns_drake.base.jobs import side_by_side as module
number = int(sys.argv.pop(1))
module.num_cores = lambda: number
forked = []
os.register_at_fork(
    before=lambda: forked.append(1),
    # In one call: lines of several processes do not mix.
    after_in_child=lambda: os.write(2, b"helping\\n"),
)
from cns_drake.__main__ import main
try:
    main()
finally:
    assert bool(forked) == (number > 1)
"""


def start(number, source, output, **options):
    arguments = [sys.executable, "-c", PROGRAM, str(number), "import"]
    return subprocess.Popen(
        [*arguments, str(source), "--output", str(output)],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        **options,
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


@pytest.mark.parametrize(
    ("name", "write"),
    [("city.osm", write_corner), ("city.json", write_blocks)],
)
def test_bytes_do_not_depend_on_the_number_of_processes(tmp_path, name, write):
    write(tmp_path / name)
    found = []
    for number in (1, 3):
        output = tmp_path / str(number) / "town"
        output.parent.mkdir()
        process = start(number, tmp_path / name, output, stdout=subprocess.PIPE)
        printed, errors = process.communicate(timeout=120)
        assert process.returncode == 0, errors
        found.append((printed, contents(output)))
    assert found[0] == found[1]
    assert len(found[0][1]) > 10


@pytest.mark.parametrize("line", ["dressing", "writing"])
def test_an_interrupted_import_leaves_nothing(tmp_path, line):
    write_corner(tmp_path / "city.osm")
    process = start(3, tmp_path / "city.osm", tmp_path / "town")
    await_word(process, line)
    # Ctrl-C reaches every process of the terminal.
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors.endswith("cns-drake: interrupted\n")
    assert [path.name for path in Path(tmp_path).iterdir()] == ["city.osm"]


@pytest.mark.parametrize("line", ["reading", "dressing", "writing"])
def test_nothing_outlives_a_killed_import(tmp_path, line):
    write_corner(tmp_path / "city.osm")
    output = tmp_path / "town"
    process = start(3, tmp_path / "city.osm", output)
    # Killed alone, while another process works for it.
    for awaited in (line, "helping"):
        await_word(process, awaited)
    process.kill()
    # Other processes have the same pipe: it ends with the last of them.
    process.communicate(timeout=60)
    assert process.returncode == -signal.SIGKILL
    left = {path.name for path in tmp_path.iterdir()}
    assert left <= {"city.osm", "town.part"}
    _, errors = start(3, tmp_path / "city.osm", output).communicate(timeout=120)
    assert "Traceback" not in errors
    assert {path.name for path in tmp_path.iterdir()} == {"city.osm", "town"}
    assert len(contents(output)) > 10
