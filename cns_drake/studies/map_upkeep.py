"""Maps of simulated drives that are updated after each drive."""

from dataclasses import dataclass
from pathlib import Path
import shutil
import tempfile

import numpy as np

from cns_drake.base.jobs.fingerprint import code_digest
from cns_drake.base.jobs.step import Reporter
from cns_drake.studies.map_truth import (
    LabelledDrive,
    is_there,
    label_points,
    labelled_drive,
)
from evaluation.map_update.baselines import run_baseline
from evaluation.map_update.labels import Label
from evaluation.map_update.scores import Labels, nearest
from evaluation.map_update.sessions import Pair, write_session
from evaluation.map_update.upkeep import TRUTH, Updates, UpkeptDrive, UpkeptMap
from evaluation.study.parts import Part
from evaluation.study.sources import DriveSource

# Distance driven between two scans of a map, as in the task `map` [m].
_SPACING = 5.0
# A point is no new one if the map has a point within this distance [m].
_KNOWN_WITHIN = 0.2


@dataclass(frozen=True)
class UpkeptSource:
    """The source of a drive in a map that later drives have updated.

    Attributes:
        sources: sources of all drives of the map, from older to newer.
        number: number of the drive among them.
        maintain: what updates the map, see `update_maps`.
        updates: file with the result of `update_maps`.
    """

    sources: tuple[DriveSource, ...]
    number: int
    maintain: str
    updates: Part

    def __call__(self) -> UpkeptDrive:
        drive = self.sources[self.number]()
        return UpkeptDrive(drive, self.updates.read(), self.number)

    def identity(self) -> list[object]:
        """Returns the identities of the drives and of the updates."""
        made_of = [one.identity() for one in self.sources]
        return [made_of, self.number, self.maintain, code_digest(__name__)]


def update_maps(
    reporter: Reporter, sources: tuple[DriveSource, ...], maintain: str
) -> Updates:
    """Returns what each drive changes in the map of the drives before it.

    Args:
        reporter: unused.
        sources: sources of the drives, from older to newer.
        maintain: name of a change detector; or `TRUTH`, for exact labels.
    """
    labelled: list[LabelledDrive] = []
    frames: list[np.ndarray] = []

    def detect(pair: Pair, number: int) -> Labels:
        if maintain != TRUTH:
            return run_baseline(maintain, pair)
        before, taken = labelled[-1], frames[-1]
        gone = label_points(pair.A, before, taken)
        far = nearest(pair.B.points, pair.A.points, _KNOWN_WITHIN)
        new = np.where(np.isinf(far), Label.NEW, Label.KEPT)
        return Labels(gone, new.astype(np.uint8))

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        kept = UpkeptMap(folder / "A", detect)
        for source in sources:
            if maintain == TRUTH:
                labelled[:] = [labelled_drive(source)]
                drive = labelled[0].drive
            else:
                drive = source()
            session, taken = write_session(drive, folder / "B", _SPACING)
            frames[:] = [taken]
            stands = np.ones(len(session.points), bool)
            if maintain == TRUTH and not labelled[0].scenario.traffic.is_off:
                stands = is_there(session.points, labelled[0].still())
            kept.add(session, stands)
            shutil.rmtree(folder / "B")
    return kept.finish()
