"""Jobs on processes of this machine: order, faults, deaths, interrupts."""

import os
import subprocess
import sys

from helpers import job_functions
from helpers.job_functions import Call
import pytest

from evaluation.base import Cluster, Job, run_jobs, show_progress
from evaluation.base.errors import FailedJobsError
from evaluation.base.file_locks import exclusive

pytestmark = pytest.mark.slow


def job(name, function, *arguments, output=None, is_done=None):
    return Job(name, Call(function, arguments, output, is_done))


@pytest.mark.parametrize("words", [[], ["--traceback"]])
def test_a_job_shows_its_traceback_on_request(monkeypatch, capsys, words):
    monkeypatch.setattr("sys.argv", ["program", *words])
    with pytest.raises(FailedJobsError, match="FILE: field: cannot be used"):
        run_jobs([job("a", job_functions.refuse)], Cluster(num_workers=1))
    assert ("in refuse\n" in capsys.readouterr().err) == bool(words)


def test_faults_stay_alone(tmp_path, capsys):
    first, process, tries, survivor = (tmp_path / name for name in "aptu")
    jobs = [
        job("first", job_functions.join, [], first, output=first),
        job("process", job_functions.note_process, process),
        job("refused", job_functions.refuse),
        job("stumbles", job_functions.stumble),
        job("dies", job_functions.die, tries, output=tries),
        job("survives", job_functions.die_first, tmp_path / "s", survivor),
    ]
    with pytest.raises(FailedJobsError) as raised, show_progress():
        run_jobs(jobs, Cluster(num_workers=2))
    assert raised.value.exit_status == 1
    assert sorted(str(raised.value).split("; ")) == [
        "dies: its process was ended by SIGKILL, perhaps for lack of memory",
        "refused: FILE: field: cannot be used",
        "stumbles: ZeroDivisionError: over nothing",
    ]
    assert first.read_text() == "a"
    assert tries.read_text() == "xxx"
    assert survivor.read_text() == "at last"
    # No lock is left behind.
    assert {path.name for path in tmp_path.iterdir()} == set("apstu")
    # The process has a session of its own, which Ctrl-C does not reach.
    pid, session, *parents = map(int, process.read_text().split())
    assert pid == session
    assert os.getpid() in parents
    reports = capsys.readouterr().err
    assert "here I am" in reports
    killed = "its process was ended by SIGKILL, perhaps for lack of memory"
    lines = reports.splitlines()
    assert sorted(line for line in lines if "repeated" in line) == [
        *[f"job dies: {killed}; it is repeated"] * 2,
        "job survives: its process ended with status 3; it is repeated",
        "job survives: not enough memory; it is repeated",
    ]
    assert "ZeroDivisionError" in reports


def test_two_never_work_on_the_same(tmp_path):
    output = tmp_path / "new" / "output"
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    script = (
        "import sys\n"
        "from pathlib import Path\n"
        "from evaluation.base.file_locks import exclusive\n"
        "output, pipe = map(Path, sys.argv[1:])\n"
        "with exclusive(output, lambda: pipe.write_text('waiting')):\n"
        "    output.write_text(output.read_text() + ' second')\n"
    )
    with exclusive(output, lambda: pytest.fail("there is nobody else")):
        other = subprocess.Popen([sys.executable, "-c", script, output, pipe])
        assert pipe.read_text() == "waiting"
        output.write_text("first")
    assert other.wait() == 0
    assert output.read_text() == "first second"
    assert list(output.parent.iterdir()) == [output]
