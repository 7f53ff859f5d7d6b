"""Forecasts how long jobs take on this machine, and the space they need."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from pathlib import Path
import shutil
import time

import numpy as np
from scipy.spatial import KDTree

from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.processes import nothing_left
from cns_drake.base.jobs.running import Job
from cns_drake.base.progress import doing

# Number of points in the KD-tree of the benchmark, and of its queries.
_POINTS = 100_000
# Time of the benchmark on the machine to which the costs of jobs refer [s].
_REFERENCE = 0.43
# Number of runs of the benchmark, which are averaged.
_REPEATS = 3
# Most memory of a job [bytes].
_JOB_MEMORY = 1.2e9


def measure_slowness() -> float:
    """Returns how many times slower this machine is than `Job.cost` assumes.

    A fixed piece of work is timed, which takes about a second. Other load on
    the machine during this second makes the result greater.
    """
    doing("measuring this machine")
    points, queries = np.random.default_rng(1).random((2, _POINTS, 3))
    begin = time.perf_counter()
    for _ in range(_REPEATS):
        KDTree(points).query(queries)
    return (time.perf_counter() - begin) / _REPEATS / _REFERENCE


def shortest_time(jobs: Sequence[Job], num_workers: int) -> float:
    """Returns the time in which jobs can be done, at best [s].

    Args:
        jobs: the jobs. If a job needs a job that is not listed, the latter
            counts as done.
        num_workers: number of jobs that run at a time.
    """
    ends: Mapping[str, float] = _end_times({job.name: job for job in jobs})
    even = sum(job.cost for job in jobs) / num_workers
    return max(even, *ends.values(), 0.0)


def _end_times(jobs: Mapping[str, Job]) -> dict[str, float]:
    """Returns when each job ends, if no job waits for a worker [s]."""
    ends: dict[str, float] = {}

    def end(name: str) -> float:
        if name not in ends:
            needed = [
                end(needed_name)
                for needed_name in jobs[name].needs
                if needed_name in jobs
            ]
            ends[name] = jobs[name].cost + max(needed, default=0.0)
        return ends[name]

    for name in jobs:
        end(name)
    return ends


@dataclass(frozen=True)
class Space:
    """Space on a disk that jobs need.

    Attributes:
        folder: folder of the results, which exists.
        most: space that the jobs need while they run [bytes].
        rest: space that the jobs' results need in the end [bytes].
    """

    folder: Path
    most: float
    rest: float

    def __str__(self) -> str:
        text = f"{_gigabytes_text(self.most)} on the disk"
        if self.rest < 0.95 * self.most:
            text += f" ({_gigabytes_text(self.rest)} in the end)"
        free = shutil.disk_usage(self.folder).free
        if free < self.most:
            text += f", which has {_gigabytes_text(free)}"
        return text


def forecast(
    jobs: Sequence[Job],
    cluster: Cluster,
    space: Space | None = None,
    least: float = 0.0,
) -> str | None:
    """Returns how long jobs take on this machine, and what space they need.

    Args:
        jobs: the jobs, of which some may be done.
        cluster: runs the jobs.
        space: space on the disk that the jobs need, if it is known.
        least: shortest time that is worth a message [s].

    Returns:
        One line of text; None if all jobs are done, if they take less than
        `least`, or if nothing is known about them.
    """
    # Whether a job is done, which takes a look at the disk, is asked only if
    # all jobs together may take long enough.
    if sum(job.cost for job in jobs) < least:
        return None
    left = [job for job in jobs if not nothing_left(job.step)]
    number = min(cluster.slots or len(left), len(left))
    seconds = shortest_time(left, number) if left else 0.0
    if not left or seconds < least:
        return None
    parts = []
    if cluster.slots is not None:
        seconds *= measure_slowness()
        parts += [
            f"about {_time_text(seconds)} with {number} at a time, as this"
            " machine was measured just now",
            f"{_gigabytes_text(number * _JOB_MEMORY)} of memory",
        ]
    if space is not None:
        parts.append(str(space))
    return f"{len(left)} jobs: {'; '.join(parts)}" if parts else None


def _time_text(seconds: float) -> str:
    """Returns a time as text, with one or two digits."""
    if seconds < 100.0:
        return f"{max(math.ceil(seconds / 10.0), 1) * 10} s"
    minutes = seconds / 60.0
    if minutes < 100.0:
        return f"{round(minutes)} minutes"
    return f"{minutes / 60.0:.1f} h"


def _gigabytes_text(number: float) -> str:
    return f"{number / 1e9:.1f} GB"
