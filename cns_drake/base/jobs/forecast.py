"""Tells, before jobs run, how many they are and the space that they need."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import shutil

from cns_drake.base.jobs.processes import nothing_left
from cns_drake.base.jobs.running import Cluster, Job

# Most memory of a job [bytes].
_JOB_MEMORY = 1.2e9


@dataclass(frozen=True)
class Space:
    """Space on a disk that jobs need.

    Attributes:
        folder: folder of the results, which exists.
        most: space that the jobs need [bytes].
    """

    folder: Path
    most: float

    def __str__(self) -> str:
        text = f"{_gigabytes_text(self.most)} on the disk"
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
    """Returns how many jobs are left, and what space they need.

    How long they take depends on the machine and its load, so the time left is
    shown only when some of them are done.

    Args:
        jobs: the jobs, of which some may be done.
        cluster: runs the jobs.
        space: space on the disk that the jobs need, if it is known.
        least: shortest time of all jobs that is worth a message [s].

    Returns:
        One line of text; None if all jobs are done, if they take less than
        `least`, or if nothing is known about them.
    """
    # Whether a job is done, which takes a look at the disk, is asked only if
    # all jobs together may take long enough.
    if sum(job.cost for job in jobs) < least:
        return None
    left = [job for job in jobs if not nothing_left(job.step)]
    if not left or sum(job.cost for job in left) < least:
        return None
    parts = []
    if cluster.slots is not None:
        number = min(cluster.slots, len(left))
        memory = _gigabytes_text(number * _JOB_MEMORY)
        parts.append(f"{memory} of memory with {number} at a time")
    if space is not None:
        parts.append(str(space))
    return f"{len(left)} jobs: {'; '.join(parts)}" if parts else None


def _gigabytes_text(number: float) -> str:
    return f"{number / 1e9:.1f} GB"
