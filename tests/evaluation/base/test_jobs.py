"""Jobs on processes of this machine: order, faults, deaths, interrupts."""

import os
import pickle
import subprocess
import sys

from helpers import job_functions
from helpers.documents import ROOT
from helpers.internal.listening import listening
from helpers.job_functions import Call
import psutil
import pytest

from evaluation.base import (
    Cluster,
    InputError,
    Job,
    JobError,
    ProcessDiedError,
    Reporter,
    choose_cluster,
    num_cores,
    run_jobs,
    run_process,
)

pytestmark = pytest.mark.slow


def job(name, function, *arguments, output=None, is_done=None):
    return Job(name, Call(function, arguments, output, is_done))


def test_finished_steps_start_no_process(tmp_path, monkeypatch):
    """No cluster starts if all is done."""
    old, path = tmp_path / "old", tmp_path / "path"
    old.write_text("old")
    done = job(
        "done", job_functions.join, [], old, is_done=job_functions.is_there
    )
    also = job("also", job_functions.refuse, is_done=job_functions.yes)
    with monkeypatch.context() as patched:
        patched.setattr(Cluster, "connect", None)
        run_jobs([also, done], Cluster(num_workers=1))
    assert old.read_text() == "old"
    new = job(
        "new", job_functions.join, [], path, is_done=job_functions.is_there
    )
    # This step is checked in its own process, after `new` is done.
    again = job(
        "again", job_functions.join, [], path, is_done=job_functions.is_there
    )
    unknown = job(
        "unknown", job_functions.join, [], tmp_path / "unknown",
        is_done=job_functions.cannot_check,
    )  # fmt: skip
    with listening() as heard:
        run_jobs([done, new, again, unknown], Cluster(num_workers=1))
    assert (tmp_path / "unknown").is_file()
    assert path.read_text() == "path"
    # The number is that of all jobs, however many were done before.
    assert heard.numbers == [(4, 1, "jobs")]


def test_a_job_checks_again_before_its_output(tmp_path):
    """Another copy of the job may have written its output first."""
    output = tmp_path / "output"
    output.write_text("of the other")
    for is_done, expected in (
        (job_functions.is_there, "of the other"),
        (job_functions.cannot_check, "output"),
    ):
        arguments = ([], output)
        run_process(
            pickle.dumps(Call(job_functions.join, arguments, output, is_done)),
            lambda *message: None,
            lambda: True,
        )
        assert output.read_text() == expected


def test_local_jobs_open_no_port(tmp_path):
    """Neither this process nor that of a job opens a port.

    No process runs the script again.
    """
    path, script = tmp_path / "ports", tmp_path / "script.py"
    script.write_text(
        "import sys\n"
        "from pathlib import Path\n"
        "from helpers import job_functions\n"
        "from evaluation.base.jobs.running import Cluster\n"
        "from evaluation.base.jobs.running import Job, run_jobs\n"
        "path = Path(sys.argv[1])\n"
        "step = job_functions.Call(job_functions.note_ports, (path,))\n"
        "run_jobs([Job('notes', step)], Cluster(2))\n"
        "assert 'distributed' not in sys.modules\n"
    )
    subprocess.run(
        [sys.executable, script, path],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        check=True,
    )
    assert path.read_text() == "processes 3, ports []"


SCRIPT = """
import asyncio, sys
from pathlib import Path
from helpers import job_functions
from evaluation.base import Cluster, Job, run_jobs

async def main(folder):
    jobs = []
    for name in "abc":
        done, mark = folder / name, folder / "marks"
        step = job_functions.Call(
            job_functions.mark, (done, mark), done, job_functions.is_made
        )
        jobs.append(Job(name, step))
    run_jobs(jobs, Cluster(2))

asyncio.run(main(Path(sys.argv[1])))
"""
# As without /dev/shm.
NO_SEMAPHORES = """
import _multiprocessing
del _multiprocessing.SemLock
"""


def test_two_runs_at_once_from_stdin_within_an_event_loop(tmp_path):
    """Each job is done once, and nothing needs semaphores."""
    runs = [
        subprocess.Popen(
            [sys.executable, "-", tmp_path],
            stdin=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        )
        for _ in range(2)
    ]
    for run in runs:
        run.stdin.write(NO_SEMAPHORES + SCRIPT)
        run.stdin.close()
    for run in runs:
        errors = run.stderr.read()
        assert run.wait() == 0, errors
        assert "Traceback" not in errors
    assert sorted((tmp_path / "marks").read_text()) == ["a", "b", "c"]
    assert {path.name for path in tmp_path.iterdir()} == {*"abc", "marks"}


def test_nothing_to_do_starts_nothing():
    run_jobs([], Cluster(scheduler="nowhere"))


def test_names_differ():
    jobs = [job("a", job_functions.refuse)] * 2
    with pytest.raises(ValueError, match="a: several jobs"):
        run_jobs(jobs, Cluster())


def test_a_job_that_is_not_wanted_ends(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reports = []

    def is_wanted():
        if not reports:
            reports.append(job_functions.read_holder(pipe))
            return True
        return False

    with pytest.raises(ProcessDiedError, match="ended with status 130"):
        run_process(
            pickle.dumps(Call(job_functions.hold, (pipe,))),
            lambda *message: None,
            is_wanted,
        )
    assert not psutil.pid_exists(reports[0])


def test_a_job_ends_with_its_parent_even_if_that_is_killed(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    parent = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import pickle, sys\n"
            "from pathlib import Path\n"
            "from helpers import job_functions\n"
            "from evaluation.base.jobs.processes import run_process\n"
            "job = job_functions.Call("
            "job_functions.hold, (Path(sys.argv[1]),))\n"
            "run_process(pickle.dumps(job), print, lambda: True)\n",
            pipe,
        ],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    process = psutil.Process(job_functions.read_holder(pipe))
    parent.kill()
    parent.wait()
    assert psutil.wait_procs([process], timeout=600)[1] == []


def test_a_function_that_cannot_be_imported_is_a_fault():
    missing = b"cno_such_module\nfunction\n."  # A pickle, by hand.
    with pytest.raises(JobError, match=r"^ModuleNotFoundError: "):
        run_process(missing, lambda *message: None, lambda: True)


def test_jobs_leave_nothing_to_each_other(tmp_path):
    jobs = [
        job(name, job_functions.leave_a_trace, tmp_path / name)
        for name in "abc"
    ]
    run_jobs(jobs, Cluster(num_workers=1))
    assert [(tmp_path / name).read_text() for name in "abc"] == ["nothing"] * 3


@pytest.mark.night
def test_a_job_survives_the_process_that_it_was_forked_from(tmp_path):
    """The jobs after it end as well."""
    paths = [tmp_path / name for name in "ab"]
    run_jobs(
        [job(path.name, job_functions.kill_parent, path) for path in paths],
        Cluster(num_workers=1),
    )
    assert [path.read_text() for path in paths] == ["at last"] * 2


@pytest.mark.night
def test_freed_memory_is_kept_whatever_dask_has_its_workers_do(tmp_path):
    script = (
        "import pickle, sys\n"
        "from pathlib import Path\n"
        "from helpers import job_functions\n"
        "from evaluation.base.jobs.processes import run_process\n"
        "name, path = sys.argv[1], Path(sys.argv[2])\n"
        "step = job_functions.Call(job_functions.note_variable, (name, path))\n"
        "run_process(pickle.dumps(step), print, lambda: True)\n"
    )
    for name, expected in (
        ("MALLOC_TRIM_THRESHOLD_", str(2**28)),
        ("CNS_DRAKE_TEST", "/x"),
    ):
        output = tmp_path / name
        subprocess.run(
            [sys.executable, "-c", script, name, output],
            env={
                **os.environ,
                name: "/x",
                "PYTHONPATH": os.pathsep.join(sys.path),
            },
            check=True,
        )
        assert output.read_text() == repr(expected)


@pytest.mark.skipif(sys.version_info < (3, 11), reason="needs Python 3.11")
def test_jobs_import_nothing_from_the_current_folder(tmp_path):
    script, here = tmp_path / "script.py", tmp_path / "here"
    script.write_text(
        "import pickle\n"
        "from pathlib import Path\n"
        "from helpers import job_functions\n"
        "from evaluation.base.jobs.processes import run_process\n"
        "step = job_functions.Call(job_functions.note_ports, (Path('done'),))\n"
        "run_process(pickle.dumps(step), print, lambda: True)\n"
    )
    here.mkdir()
    for name in ("cns_drake", "evaluation", "worlds", "selectors", "yaml"):
        (here / f"{name}.py").write_text("raise SystemExit('not this one')\n")
    subprocess.run(
        [sys.executable, script],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        cwd=here,
        check=True,
    )
    assert (here / "done").exists()


def test_progress_is_reported_now_and_then(monkeypatch):
    now = [100.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    reports = []
    reporter = Reporter(lambda *message: reports.append(message))
    for done in range(11):
        reporter.doing("reading", done, 10)
        now[0] += 0.2
    # The first and the last one are shown, and one in half a second.
    assert [report[2] for report in reports] == [0, 3, 6, 9, 10]
    reporter.note(3)
    assert reports[-1] == ("note", "3")
    Reporter().doing("reading", 1, 2)


def test_where_jobs_run(monkeypatch):
    monkeypatch.delenv("DASK_SCHEDULER_ADDRESS", raising=False)
    assert choose_cluster(None, None) == Cluster(num_cores())
    monkeypatch.setenv("DASK_SCHEDULER_ADDRESS", "tcp://a:1")
    assert choose_cluster(None, None).scheduler == "tcp://a:1"
    assert choose_cluster(None, "tcp://b:2").scheduler == "tcp://b:2"
    assert choose_cluster(3, None) == Cluster(3)
    for num_jobs, message in (
        (0, "0 is not a positive"),
        (-1, "-1 is not"),
    ):
        with pytest.raises(InputError, match=f"--jobs: {message}"):
            choose_cluster(num_jobs, None)
    with pytest.raises(InputError, match="--jobs and --scheduler"):
        choose_cluster(1, "tcp://b:2")


@pytest.mark.night
def test_commands_that_need_no_cluster_do_not_load_it():
    script = (
        "import sys\n"
        "import cns_drake.command_line.cli\n"
        "import cns_drake.studies.recording\n"
        "import cns_drake.studies.reproduction\n"
        "import evaluation.command_line.cli, evaluation.base.jobs.running\n"
        "assert not {'dask', 'distributed'} & sys.modules.keys()\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True, cwd=ROOT)


def test_a_scheduler_without_dask(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    step = Call(job_functions.join, ([],), tmp_path / "output")
    with pytest.raises(InputError, match=r"pip install 'cns-eval\[dask\]'"):
        run_jobs([Job("one", step)], Cluster(scheduler="tcp://127.0.0.1:1"))
    assert not (tmp_path / "output").exists()
