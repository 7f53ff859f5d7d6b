"""Forecasts how long jobs take on this machine, and the space they need."""

from collections.abc import Mapping, Sequence
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

# The yardstick: so many points are looked for in a tree of as many. It takes
# this time on the machine to which the costs of jobs belong [s].
_POINTS = 100_000
_REFERENCE = 0.29
_REPEATS = 3
# Most memory of a job that records or reads a shipped drive [bytes].
_JOB_MEMORY = 1.2e9


def measure_slowness() -> float:
    """Returns how much slower this machine is than the one of the costs.

    A fixed piece of work is timed, which takes about a second. Other load on
    the machine at that time makes the result greater.
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
        jobs: the jobs. Jobs that they need and that are not among them count as
            done.
        num_workers: number of jobs that run at a time.
    """
    ends: Mapping[str, float] = _ends({job.name: job for job in jobs})
    even = sum(job.cost for job in jobs) / num_workers
    return max(even, *ends.values(), 0.0)


def _ends(jobs: Mapping[str, Job]) -> dict[str, float]:
    """Returns when each job ends if none waits for a worker [s]."""
    ends: dict[str, float] = {}

    def end(name: str) -> float:
        if name not in ends:
            needed = [end(one) for one in jobs[name].needs if one in jobs]
            ends[name] = jobs[name].cost + max(needed, default=0.0)
        return ends[name]

    for name in jobs:
        end(name)
    return ends


def forecast(
    jobs: Sequence[Job],
    cluster: Cluster,
    output: Path,
    most: float,
    rest: float,
) -> str | None:
    """Returns how long jobs take on this machine, and what space they need.

    Args:
        jobs: the jobs, of which some may be done.
        cluster: runs the jobs.
        output: folder of the results, which exists.
        most: space on the disk that they need while they run [bytes].
        rest: space that their results need in the end [bytes].

    Returns:
        One line of text; None if all jobs are done.
    """
    left = [job for job in jobs if not nothing_left(job.step)]
    if not left:
        return None
    parts = []
    if cluster.slots is not None:
        number = min(cluster.slots, len(left))
        seconds = shortest_time(left, number) * measure_slowness()
        parts += [
            f"about {_rounded(seconds)} with {number} at a time, as this"
            " machine was measured just now",
            f"{_gigabytes(number * _JOB_MEMORY)} of memory",
        ]
    space = f"{_gigabytes(most)} on the disk"
    if rest < 0.95 * most:
        space += f" ({_gigabytes(rest)} in the end)"
    free = shutil.disk_usage(output).free
    if free < most:
        space += f", which has {_gigabytes(free)}"
    return f"{len(left)} jobs: {'; '.join([*parts, space])}"


def _rounded(seconds: float) -> str:
    """Returns a time as text, with one or two digits."""
    if seconds < 100.0:
        return f"{max(math.ceil(seconds / 10.0), 1) * 10} s"
    minutes = seconds / 60.0
    if minutes < 100.0:
        return f"{round(minutes)} minutes"
    return f"{minutes / 60.0:.1f} h"


def _gigabytes(number: float) -> str:
    return f"{number / 1e9:.1f} GB"
