"""Jobs on processes of this machine: order, faults, deaths, interrupts."""

import contextlib
import os
import pickle
import subprocess
import sys
from types import SimpleNamespace

from helpers import job_functions
from helpers.documents import ROOT
from helpers.job_functions import Call
import psutil
import pytest

from cns_drake.base import (
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
    show_progress,
)
from cns_drake.base.errors import FailedJobsError
from cns_drake.base.file_locks import exclusive
from cns_drake.base.jobs import cluster, processes
from cns_drake.base.jobs.cluster import DaskWorkers, LostSchedulerError

pytestmark = pytest.mark.slow


def job(
    name, function, *arguments, needs=(), cost=1.0, output=None, is_done=None
):
    step = Call(function, arguments, output, is_done)
    return Job(name, step, tuple(needs), cost)


def test_finished_steps_start_no_process(tmp_path, monkeypatch, capsys):
    """No cluster starts if all is done; jobs that need other work do start."""
    old, path = tmp_path / "old", tmp_path / "path"
    old.write_text("old")
    done = job(
        "done", job_functions.join, [], old, is_done=job_functions.is_there
    )
    also = job(
        "also", job_functions.refuse, needs=["done"], is_done=job_functions.yes
    )
    with monkeypatch.context() as patched:
        patched.setattr(Cluster, "connect", None)
        run_jobs([also, done], Cluster(num_workers=1))
    assert old.read_text() == "old"
    new = job(
        "new", job_functions.join, [], path, needs=["done"],
        is_done=job_functions.is_there,
    )  # fmt: skip
    # This step is checked in its own process, after `new` is done.
    again = job(
        "again", job_functions.join, [], path, needs=["new"],
        is_done=job_functions.is_there,
    )  # fmt: skip
    unknown = job(
        "unknown", job_functions.join, [], tmp_path / "unknown",
        is_done=job_functions.cannot_check,
    )  # fmt: skip
    with show_progress():
        run_jobs([done, new, again, unknown], Cluster(num_workers=1))
    assert (tmp_path / "unknown").is_file()
    assert path.read_text() == "path"
    # The number is that of all jobs, however many were done before.
    assert "of 4 jobs" in capsys.readouterr().err


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


@pytest.mark.parametrize("words", [[], ["--traceback"]])
def test_a_job_shows_its_traceback_on_request(monkeypatch, capsys, words):
    monkeypatch.setattr("sys.argv", ["program", *words])
    with pytest.raises(FailedJobsError, match="FILE: field: cannot be used"):
        run_jobs([job("a", job_functions.refuse)], Cluster(num_workers=1))
    assert ("in refuse\n" in capsys.readouterr().err) == bool(words)


def test_a_fault_outside_the_job_shows_where_it_arose(monkeypatch, capsys):
    def fail(*arguments):
        raise AssertionError

    monkeypatch.setattr(cluster, "run_process", fail)
    with pytest.raises(FailedJobsError, match="a: AssertionError"):
        run_jobs([job("a", job_functions.refuse)], Cluster(num_workers=1))
    assert "in fail\n" in capsys.readouterr().err


def test_needs_come_first_and_faults_stay_alone(tmp_path, capsys):
    first, second, both, last = (tmp_path / name for name in "abcd")
    process, tries, survivor = (tmp_path / name for name in "ptu")
    jobs = [
        # The job with the most needs comes first in the list and runs last.
        job("last", job_functions.join, [both], last, needs=["both"]),
        job(
            "both",
            job_functions.join,
            [first, second],
            both,
            needs=["first", "second"],
            output=both,
        ),
        job("first", job_functions.join, [], first, cost=7.0, output=first),
        job("second", job_functions.join, [], second),
        job("process", job_functions.note_process, process),
        job("refused", job_functions.refuse),
        job("stumbles", job_functions.stumble),
        job("dies", job_functions.die, tries, output=tries),
        job("survives", job_functions.die_first, tmp_path / "s", survivor),
        job("orphan", job_functions.join, [], tmp_path / "o", needs=["dies"]),
        job("orphan 2", job_functions.join, [], last, needs=["orphan"]),
    ]
    with pytest.raises(FailedJobsError) as raised, show_progress():
        run_jobs(jobs, Cluster(num_workers=2))
    assert raised.value.exit_status == 1
    *faults, left_out = str(raised.value).split("; ")
    assert sorted(faults) == [
        "dies: its process was ended by SIGKILL, perhaps for lack of memory",
        "refused: FILE: field: cannot be used",
        "stumbles: ZeroDivisionError: over nothing",
    ]
    assert left_out.endswith("need failed jobs: orphan, orphan 2")
    assert last.read_text() == both.read_text() == "a+b"
    assert tries.read_text() == "xxx"
    assert survivor.read_text() == "at last"
    # No lock is left behind.
    assert {path.name for path in tmp_path.iterdir()} == set("abcdpstu")
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
    assert "last: done" in reports


class ScriptedCluster:
    """Workers whose jobs end as a script says, one after the other.

    Attributes:
        slots: see `Cluster`.
        names: of the submitted jobs.
    """

    def __init__(self, *errors, slots=None):
        self._errors = iter(errors)
        self.slots = slots
        self.names = []

    @contextlib.contextmanager
    def connect(self, listener):
        self._listener = listener
        yield self

    def submit(self, name, job, priority):
        self.names.append(name)
        self._listener("result", name, next(self._errors))


DIED = ProcessDiedError("its worker died")


def test_results_lost_with_a_worker_are_computed_again(capsys):
    cluster = ScriptedCluster(DIED, DIED, None)
    run_jobs([job("a", job_functions.refuse)], cluster)
    assert cluster.names == ["a"] * 3
    told = "job a: its worker died; it is repeated"
    assert capsys.readouterr().err.splitlines() == [told] * 2
    with pytest.raises(FailedJobsError, match=r"^a: its worker died$"):
        run_jobs([job("a", job_functions.refuse)], ScriptedCluster(*[DIED] * 3))


@pytest.mark.parametrize(
    ("slots", "order"),
    [(1, "b first; c needs b; a; d"), (None, "b first; a; d; c needs b")],
)
def test_a_free_worker_gets_the_most_urgent_job(slots, order):
    """The most urgent job may have changed since its last job began."""
    jobs = [
        job("a", job_functions.refuse, cost=3.0),
        job("b first", job_functions.refuse, cost=1.0),
        job("c needs b", job_functions.refuse, needs=["b first"], cost=4.0),
        job("d", job_functions.refuse, cost=2.0),
    ]
    cluster = ScriptedCluster(*[None] * 4, slots=slots)
    run_jobs(jobs, cluster)
    assert "; ".join(cluster.names) == order


def test_a_fault_makes_room_for_the_next(capsys):
    cluster = ScriptedCluster(DIED, DIED, DIED, None, slots=1)
    jobs = [job(name, job_functions.refuse) for name in "ab"]
    with pytest.raises(FailedJobsError, match=r"^a: its worker died$"):
        run_jobs(jobs, cluster)
    assert len(cluster.names) == 4
    assert "a: failed: its worker died" in capsys.readouterr().err


def test_a_scheduler_that_is_lost():
    """The client reports the loss; finished keys are not fetched again."""
    reports, keys = [], []
    statuses = iter(["cancelled", "lost", "finished"])

    def submit(function, *arguments, key, **options):
        keys.append(key)
        future = SimpleNamespace(status=next(statuses))
        future.add_done_callback = lambda take: take(future)
        return future

    client = SimpleNamespace(
        scheduler=SimpleNamespace(address="tcp://scripted:1"),
        nthreads=dict,
        subscribe_topic=lambda topic, handler: None,
        submit=submit,
    )
    workers = DaskWorkers(client, lambda *message: reports.append(message))
    for _ in range(3):
        workers.submit("a", b"", 1.0)
    note, lost, died, done = reports
    assert note == ("note", "", "tcp://scripted:1: no workers yet, waiting")
    assert isinstance(lost[2], LostSchedulerError)
    assert str(lost[2]).startswith("tcp://scripted:1: the connection")
    assert isinstance(died[2], ProcessDiedError)
    assert done == ("result", "a", None)
    assert len(set(keys)) == 3
    with pytest.raises(InputError, match=r"^tcp://scripted:1: the connection"):
        run_jobs([job("a", job_functions.refuse)], ScriptedCluster(lost[2]))


def test_local_jobs_open_no_port(tmp_path):
    """Neither this process nor that of a job opens a port.

    No process runs the script again.
    """
    path, script = tmp_path / "ports", tmp_path / "script.py"
    script.write_text(
        "import sys\n"
        "from pathlib import Path\n"
        "from helpers import job_functions\n"
        "from cns_drake.base.jobs.cluster import Cluster\n"
        "from cns_drake.base.jobs.running import Job, run_jobs\n"
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


def test_nothing_to_do_starts_nothing():
    run_jobs([], Cluster(scheduler="nowhere"))


@pytest.mark.parametrize(
    ("need_of_a", "message"),
    [("b", "cycle"), ("c", "a: needs c, which is no job")],
)
def test_needs_must_make_sense(need_of_a, message):
    jobs = [
        job("a", job_functions.refuse, needs=[need_of_a]),
        job("b", job_functions.refuse, needs=["a"]),
    ]
    with pytest.raises(ValueError, match=message):
        run_jobs(jobs, Cluster())


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


def test_threads_ask_for_statuses_in_turns():
    """Otherwise, a start could take the status for which a thread waits."""

    class Ending:
        """A process that has a status when it is asked for the second time."""

        def __init__(self, sentinel):
            self.sentinel = sentinel
            self.calls = []

        def terminate(self):
            self.calls.append("terminate")

        def kill(self):
            self.calls.append("kill")

        @property
        def exitcode(self):
            assert processes._starting.locked()
            self.calls.append("exitcode")
            return -15 if self.calls.count("exitcode") > 1 else None

    read_end, write_end = os.pipe()
    try:
        os.write(write_end, b"!")
        process = Ending(read_end)
        assert processes._end_process(process) == -15
    finally:
        os.close(read_end)
        os.close(write_end)
    assert process.calls == ["terminate", "exitcode", "exitcode"]
    assert not processes._starting.locked()


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
            "from cns_drake.base.jobs.processes import run_process\n"
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
        "from cns_drake.base.jobs.processes import run_process\n"
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
        "from cns_drake.base.jobs.processes import run_process\n"
        "step = job_functions.Call(job_functions.note_ports, (Path('done'),))\n"
        "run_process(pickle.dumps(step), print, lambda: True)\n"
    )
    here.mkdir()
    for name in ("cns_drake", "evaluation", "selectors", "yaml"):
        (here / f"{name}.py").write_text("raise SystemExit('not this one')\n")
    subprocess.run(
        [sys.executable, script],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        cwd=here,
        check=True,
    )
    assert (here / "done").exists()


def test_two_never_work_on_the_same(tmp_path):
    output = tmp_path / "new" / "output"
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    script = (
        "import sys\n"
        "from pathlib import Path\n"
        "from cns_drake.base.file_locks import exclusive\n"
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


def test_a_lock_that_cannot_be_written(tmp_path):
    (tmp_path / "file").touch()
    with (
        pytest.raises(InputError, match="file"),
        exclusive(tmp_path / "file" / "x", lambda: None),
    ):
        pass


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
    assert choose_cluster(1024, None) == Cluster(1024)
    for num_jobs, message in (
        (0, "0 is not a positive"),
        (-1, "-1 is not"),
        (1025, "1025 is more than 1024"),
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
        "import cns_drake.studies.recordings.recording\n"
        "import cns_drake.studies.recordings.reproduction\n"
        "import evaluation.command_line.cli, cns_drake.base.jobs.running\n"
        "assert not {'dask', 'distributed'} & sys.modules.keys()\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True, cwd=ROOT)
