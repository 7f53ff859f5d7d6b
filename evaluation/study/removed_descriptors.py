"""Removes descriptors that no result needs, and has them computed again.

Descriptors take three quarters of the space of a study, and are needed only
until results have been made from them.
"""

from collections.abc import Collection, Iterable
from pathlib import Path

from cns_drake.base import Job, Steps, nothing_left
from evaluation.study.feature_extraction import FeatureExtraction
from evaluation.study.storage.parts import MakePart, Part


def remove_descriptors(jobs: Iterable[Job]) -> None:
    """Removes the descriptors that jobs keep only until the study is done.

    The steps of these jobs have `FeatureExtraction.removes_descriptors`. All
    jobs must be done.

    Raises:
        InputError: a file cannot be written.
    """
    for job in jobs:
        if (
            isinstance(job.step, FeatureExtraction)
            and job.step.removes_descriptors
        ):
            job.step.files.remove_descriptors()


def renew_removed_descriptors(jobs: Collection[Job]) -> None:
    """Lets jobs compute removed descriptors again if new results need them.

    Args:
        jobs: all jobs of a study, each after the jobs that it needs.
    """
    if not any(
        isinstance(one.step, FeatureExtraction) and one.step.removes_descriptors
        for one in jobs
    ):
        return
    names = {job.name for job in jobs}
    # Files that will be written, and folders of features of new recordings.
    stale: set[Path] = set()
    needed: list[Part] = []
    for job in jobs:
        if isinstance(job.step, FeatureExtraction):
            stale.update(part.path for part in job.step.missing())
            if not names.issuperset(job.needs):
                stale.add(job.step.files.folder)
            continue
        steps = job.step.steps if isinstance(job.step, Steps) else [job.step]
        for step in steps:
            if isinstance(step, MakePart):
                inputs = list(step.parts())
                read = {one.path for one in inputs}
                read |= {one.path.parent for one in inputs}
                if not stale.isdisjoint(read) or not nothing_left(step):
                    stale.add(step.part.path)
                    needed += inputs
    for part in needed:
        part.discard_if_value_removed()
