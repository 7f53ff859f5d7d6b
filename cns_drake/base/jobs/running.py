"""Running many jobs in parallel, on one machine or on a cluster."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
import graphlib
import pickle
import queue
import time

from cns_drake.base.errors import FailedJobsError, InputError, one_line
from cns_drake.base.jobs import processes
from cns_drake.base.jobs.cluster import Cluster, LostSchedulerError, Workers
from cns_drake.base.jobs.step import Step
from cns_drake.base.progress import JobsListener, listener
from cns_drake.base.terminal import note, resumable

# How often a job is started again after its process has died.
_RETRIES = 2
# How long to wait for a message before a signal is looked for [s].
_LOOK_INTERVAL = 0.5


@dataclass(frozen=True)
class Job:
    """A step to be run in a process of its own.

    Attributes:
        name: unique name, shown to the user.
        step: the work. `step.is_done` is called before a process is started, to
            save the process, and again in the process, because another copy of
            the job may have finished first.
        needs: names of the jobs that must succeed before this job starts.
        cost: expected time on one core [s].
    """

    name: str
    step: Step
    needs: tuple[str, ...] = ()
    cost: float = 1.0


def run_jobs(
    jobs: Iterable[Job],
    cluster: Cluster,
    unit: str = "jobs",
    *,
    resumes: bool = True,
) -> None:
    """Runs jobs on a cluster, the longest chains of dependent jobs first.

    Notes of the jobs are printed on stderr. A job whose process or worker dies
    is repeated, and a note says so. A job that fails stops only the jobs that
    need it.

    Args:
        jobs: the jobs.
        cluster: runs them.
        unit: what the jobs are, such as `cities`.
        resumes: whether another run can use the files of finished jobs; if the
            work is interrupted, a note says so.

    Raises:
        FailedJobsError: if jobs could not be done; the error names all of these
            jobs.
        InputError: if the scheduler does not answer.
    """
    by_name = _by_name(jobs)
    needs = {name: job.needs for name, job in by_name.items()}
    order = list(graphlib.TopologicalSorter(needs).static_order())
    # Name -> cost of the longest chain that begins with the job.
    urgency = {name: job.cost for name, job in by_name.items()}
    for name in reversed(order):
        for need in needs[name]:
            cost = by_name[need].cost + urgency[name]
            urgency[need] = max(urgency[need], cost)
    done: set[str] = set()
    for name in order:
        if done.issuperset(needs[name]) and processes.nothing_left(
            by_name[name].step
        ):
            done.add(name)
    left = {name: by_name[name] for name in by_name if name not in done}
    if not left:
        return
    messages: queue.SimpleQueue = queue.SimpleQueue()
    costs = {name: job.cost for name, job in left.items()}
    with (
        resumable() if resumes else nullcontext(),
        listener().jobs(costs, len(done), unit) as shown,
        cluster.connect(lambda *message: messages.put(message)) as workers,
    ):
        run = _Run(left, done, urgency, workers, messages, shown, cluster.slots)
        run.run()
    run.raise_faults()


def _by_name(jobs: Iterable[Job]) -> dict[str, Job]:
    jobs = list(jobs)
    by_name = {job.name: job for job in jobs}
    if len(by_name) < len(jobs):
        name, _ = Counter(job.name for job in jobs).most_common(1)[0]
        raise ValueError(f"{name}: several jobs have this name")
    for job in jobs:
        for need in job.needs:
            if need not in by_name:
                raise ValueError(f"{job.name}: needs {need}, which is no job")
    return by_name


def _repeated(name: str, why: object) -> str:
    return f"job {name}: {why}; it is repeated"


@dataclass
class _Run:
    """One run of jobs on workers."""

    _jobs: Mapping[str, Job]
    _done: set[str]
    _urgency: Mapping[str, float]
    _workers: Workers
    _messages: queue.SimpleQueue
    _shown: JobsListener
    _slots: int | None

    def __post_init__(self) -> None:
        self._waiting = dict(self._jobs)
        # Jobs without a result.
        self._submitted: set[str] = set()
        # Jobs that have reported their start and not their end.
        self._running: set[str] = set()
        self._deaths: Counter = Counter()
        self._faults: dict[str, str] = {}

    def run(self) -> None:
        """Runs jobs until none is left that can run."""
        self._submit_ready()
        try:
            while self._submitted:
                self._receive(_LOOK_INTERVAL)
        except KeyboardInterrupt:
            self._stop()
            raise

    def raise_faults(self) -> None:
        """Raises FailedJobsError if a job failed."""
        if not self._faults:
            return
        parts = [f"{name}: {fault}" for name, fault in self._faults.items()]
        if self._waiting:
            parts.append(
                "not run, since they need failed jobs: "
                f"{', '.join(self._waiting)}"
            )
        raise FailedJobsError("; ".join(parts))

    def _submit_ready(self) -> None:
        """Submits jobs while there is room, the most urgent first."""
        while self._slots is None or len(self._submitted) < self._slots:
            ready = [
                name
                for name, job in self._waiting.items()
                if self._done.issuperset(job.needs)
            ]
            if not ready:
                return
            name = max(ready, key=lambda name: self._urgency[name])
            job = self._waiting.pop(name)
            # The jobs it needs may have left it nothing to do.
            if job.needs and processes.nothing_left(job.step):
                self._done.add(name)
                self._shown.end(name)
            else:
                self._submit(name)

    def _submit(self, name: str) -> None:
        self._submitted.add(name)
        step = pickle.dumps(self._jobs[name].step)
        self._workers.submit(name, step, self._urgency[name])

    def _receive(self, timeout: float) -> None:
        """Acts on the next message of a job, waiting at most `timeout` [s]."""
        try:
            kind, name, *values = self._messages.get(timeout=timeout)
        except queue.Empty:
            return
        if kind == "result":
            # Cancelled jobs are not reported.
            if name in self._submitted:
                self._submitted.remove(name)
                self._take_result(name, *values)
        elif kind == "started":
            if name in self._running:  # Dask repeats it by itself.
                note(_repeated(name, "its worker died"))
            self._running.add(name)
            self._shown.start(name)
        elif kind == "ended":
            self._running.discard(name)
        elif kind == "doing":
            self._shown.doing(name, *values)
        else:
            note(*values)

    def _take_result(self, name: str, error: Exception | None) -> None:
        self._running.discard(name)
        if error is None:
            self._done.add(name)
            self._shown.end(name)
            self._submit_ready()
            return
        if isinstance(error, LostSchedulerError):
            raise error
        if (
            isinstance(error, processes.ProcessDiedError)
            and self._deaths[name] < _RETRIES
        ):
            self._deaths[name] += 1
            note(_repeated(name, error))
            self._submit(name)
            return
        fault = str(error)
        if not isinstance(
            error, InputError | processes.JobError | processes.ProcessDiedError
        ):
            fault = one_line(f"{type(error).__name__}: {error}")
        self._faults[name] = fault
        self._shown.end(name, fault=True)
        self._submit_ready()
        if self._submitted:
            note(f"{name}: failed: {fault}")

    def _stop(self) -> None:
        """Ends running jobs, and waits until they have closed their files."""
        self._submitted.clear()
        self._workers.stop()
        deadline = time.monotonic() + processes.PATIENCE + _LOOK_INTERVAL
        while self._running and (left := deadline - time.monotonic()) > 0:
            self._receive(min(left, _LOOK_INTERVAL))
