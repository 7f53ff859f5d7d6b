"""The task `judge`: can a classifier tell real scans from simulated scans?"""

from collections.abc import Iterator
import math
from typing import Any

from cns_drake.base import Reporter
from evaluation.real.image_sequences import (
    ImageSource,
)
from evaluation.recognition import Number
from evaluation.study import DriveSource, Jobs, Pair, Result, Task

# Number of random samples of patches for the classifier; their AUCs differ by
# up to 0.04.
_DRAWS = 1


class JudgeTask(Task):
    """Measures how well a classifier tells real scans from simulated scans.

    The simulated scans are the scans of the jobs' distractors.
    """

    name = "judge"

    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Result, ...]:
        part = jobs.files.part("judge", pair.key)
        made = tuple(drive.source for drive in jobs.distractors)
        return (jobs.add(part, judge_scans, (pair.query.source, made)),)

    def numbers(
        self, found: dict[str, Any] | None, before: Any | None
    ) -> Iterator[Number]:
        if found is None:
            return
        num_real, _ = found["patches"]
        for group, auc in found["auc"].items():
            values = {"auc": auc, "auc_control": found["control"][group]}
            for name, value in values.items():
                if not math.isnan(value):
                    yield Number(group, False, name, value, n=num_real)


def judge_scans(
    reporter: Reporter, source: DriveSource, made: tuple[DriveSource, ...]
) -> dict[str, Any] | None:
    """Returns how well a classifier tells a data set from simulated scans.

    Real images are compared with images that are made of the simulated scans.

    Args:
        reporter: reports notes.
        source: the data set, or a sequence of images.
        made: the simulated drives.

    Returns:
        The result of `evaluation.real.judge.judge_draws`; None for a data set
        of a single place.
    """
    # Imported here: the module needs the optional packages of the extra
    # `judge`. Studies without this task must work without these packages.
    from evaluation.real import judge

    drive = source()
    is_of_images = isinstance(source, ImageSource)
    table = judge.image_table if is_of_images else judge.scan_table
    places = judge.places_of([drive], table, reporter.note)
    if len(places) < 2:
        reporter.note(f"{drive.name}: one place, not judged")
        return None
    simulated = judge.places_of(
        (recording() for recording in made), table, reporter.note
    )
    return judge.judge_draws(places, simulated, _DRAWS)
