"""Many jobs, side by side, on one machine or on a cluster."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import graphlib
import pickle
import queue
import time
from typing import TYPE_CHECKING

from cns_drake.base.errors import FailedJobsError, InputError, one_line
from cns_drake.base.jobs.cluster import Cluster, LostSchedulerError, Workers
from cns_drake.base.jobs.processes import (
    PATIENCE,
    JobError,
    ProcessDiedError,
    nothing_left,
)
from cns_drake.base.jobs.step import Step

if TYPE_CHECKING:
    from cns_drake.base.jobs.job_progress import JobProgress

# How often a job is started again after its process has died.
_RETRIES = 2
# How often the display is redrawn [s].
_REFRESH_INTERVAL = 0.5


@dataclass(frozen=True)
class Job:
    """A step to be run in a process of its own.

    Attributes:
        name: unique, for people.
        step: the work. `is_done` is called here once the needed jobs are done,
            which saves a process, and again by the process, since another copy
            of the job may have finished first.
        needs: names of jobs that must have succeeded before.
        cost: expected time on one core [s].
    """

    name: str
    step: Step
    needs: tuple[str, ...] = ()
    cost: float = 1.0


def run_jobs(jobs: Iterable[Job], cluster: Cluster) -> None:
    """Runs jobs; those with the longest chain of work behind them first.

    Shows progress on stderr. A job whose process or worker dies is started
    again. A job that cannot be done stops only the jobs that need it.

    Raises:
        FailedJobsError: if some could not be done; all are named.
        InputError: if the scheduler does not answer.
    """
    by_name = _by_name(jobs)
    urgency = _urgency(by_name)
    done = _find_done(by_name)
    by_name = {name: by_name[name] for name in by_name if name not in done}
    if not by_name:
        return
    from cns_drake.base.jobs.job_progress import JobProgress

    messages: queue.SimpleQueue = queue.SimpleQueue()
    with (
        JobProgress({job.name: job.cost for job in by_name.values()}) as shown,
        cluster.connect(lambda *message: messages.put(message)) as workers,
    ):
        run = _Run(
            by_name, done, urgency, workers, messages, shown, cluster.slots
        )
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


def _urgency(jobs: Mapping[str, Job]) -> dict[str, float]:
    """Returns name -> cost of the longest chain that begins with the job."""
    urgency = {name: job.cost for name, job in jobs.items()}
    for name in reversed(_ordered(jobs)):
        for need in jobs[name].needs:
            urgency[need] = max(urgency[need], jobs[need].cost + urgency[name])
    return urgency


def _find_done(jobs: Mapping[str, Job]) -> set[str]:
    """Returns the names of jobs that have nothing to do."""
    done: set[str] = set()
    for name in _ordered(jobs):
        job = jobs[name]
        if done.issuperset(job.needs) and nothing_left(job.step):
            done.add(name)
    return done


def _ordered(jobs: Mapping[str, Job]) -> list[str]:
    """Returns names so that what a job needs comes before it."""
    needs = {job.name: job.needs for job in jobs.values()}
    return list(graphlib.TopologicalSorter(needs).static_order())


@dataclass
class _Run:
    """One run of jobs on workers."""

    _jobs: Mapping[str, Job]
    _done: set[str]
    _urgency: Mapping[str, float]
    _workers: Workers
    _messages: queue.SimpleQueue
    _shown: JobProgress
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
        """Runs until nothing more can be done."""
        self._submit_ready()
        try:
            while self._submitted:
                self._take_in(_REFRESH_INTERVAL)
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
        while (job := self._most_urgent()) is not None:
            del self._waiting[job.name]
            # The jobs it needs may have left it nothing to do.
            if job.needs and nothing_left(job.step):
                self._done.add(job.name)
                self._shown.end(job.name)
            else:
                self._submit(job)

    def _most_urgent(self) -> Job | None:
        """Returns the next job, if there is one and there is room for it."""
        if self._slots is not None and len(self._submitted) >= self._slots:
            return None
        ready = (
            job
            for job in self._waiting.values()
            if self._done.issuperset(job.needs)
        )
        return max(ready, key=lambda job: self._urgency[job.name], default=None)

    def _submit(self, job: Job) -> None:
        self._submitted.add(job.name)
        self._workers.submit(
            job.name,
            pickle.dumps(job.step),
            self._urgency[job.name],
        )

    def _take_in(self, timeout: float) -> None:
        try:
            kind, name, *values = self._messages.get(timeout=timeout)
        except queue.Empty:
            self._shown.refresh()
            return
        if kind == "result":
            # Cancelled jobs are not reported.
            if name in self._submitted:
                self._submitted.remove(name)
                self._take_result(name, *values)
        elif kind == "started":
            self._running.add(name)
            self._shown.start(name)
        elif kind == "ended":
            self._running.discard(name)
        elif kind == "progress":
            self._shown.progress(name, *values)
        else:
            self._shown.note(*values)

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
            isinstance(error, ProcessDiedError)
            and self._deaths[name] < _RETRIES
        ):
            self._deaths[name] += 1
            self._shown.note(f"{name}: {error}; it starts again")
            self._submit(self._jobs[name])
            return
        self._faults[name] = _describe(error)
        self._shown.end(name, fault=True)
        self._submit_ready()
        if self._submitted:
            self._shown.note(f"{name}: failed: {self._faults[name]}")

    def _stop(self) -> None:
        """Ends what is running, and waits until it has closed its files."""
        self._submitted.clear()
        self._workers.stop()
        deadline = time.monotonic() + PATIENCE
        while self._running and (left := deadline - time.monotonic()) > 0:
            self._take_in(min(left, _REFRESH_INTERVAL))


def _describe(error: Exception) -> str:
    if isinstance(error, InputError | JobError | ProcessDiedError):
        return str(error)
    return one_line(f"{type(error).__name__}: {error}")
