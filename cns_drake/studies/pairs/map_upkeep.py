"""Maps of simulated drives that are updated after each drive."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
import shutil
import tempfile

import numpy as np

from cns_drake.ground_truth import (
    LabelledDrive,
    is_there,
    label_points,
    labelled_drive,
)
from evaluation.base import Part, Reporter
from evaluation.drives import DriveSource
from evaluation.map_update import (
    TRUTH,
    Label,
    PairLabels,
    SessionPair,
    Updates,
    UpkeptDrive,
    UpkeptMap,
    nearest_distances,
    run_baseline,
    write_session,
)

# Counts the changes of how maps are updated. Raise it with each such change.
UPKEEP_VERSION = 1
# Distance driven between two scans of a map, as in the task `map` [m].
_SPACING = 5.0
# A point is no new one if the map has a point within this distance [m].
_KNOWN_WITHIN = 0.2


@dataclass(frozen=True)
class UpkeptSource:
    """The source of a drive in a map that later drives have updated.

    Attributes:
        sources: sources of all drives of the map, from older to newer.
        number: number of the drive among `sources`.
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
        return [made_of, self.number, self.maintain, UPKEEP_VERSION]


def update_maps(
    reporter: Reporter, sources: tuple[DriveSource, ...], maintain: str
) -> Updates:
    """Returns the changes that each drive makes to the map of earlier drives.

    Args:
        reporter: unused.
        sources: sources of the drives, from older to newer.
        maintain: name of a change detector; or `TRUTH`, for exact labels.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        kept = UpkeptMap(folder / "A")
        for source in sources:
            if maintain == TRUTH:
                labelled = labelled_drive(source)
                session, frames = write_session(
                    labelled.drive, folder / "B", _SPACING
                )
                stands = _on_still_surfaces(session.points, labelled)
                detect = partial(_exact_labels, drive=labelled, frames=frames)
            else:
                session, _ = write_session(source(), folder / "B", _SPACING)
                stands = np.ones(len(session.points), bool)
                detect = partial(run_baseline, maintain)
            kept.add(session, stands, detect)
            shutil.rmtree(folder / "B")
    return kept.finish()


def _on_still_surfaces(
    points: np.ndarray, labelled: LabelledDrive
) -> np.ndarray:
    """Returns which points (N, 3) of a drive are not on traffic, (N,) bool."""
    if labelled.scenario.traffic.is_off:
        return np.ones(len(points), bool)
    return is_there(points, labelled.still())


def _exact_labels(
    pair: SessionPair, *, drive: LabelledDrive, frames: np.ndarray
) -> PairLabels:
    """Returns the exact labels of the map so far and of the next drive's map.

    Args:
        pair: the two maps.
        drive: the next drive.
        frames: (K,) numbers of the frames whose scans make the drive's map.
    """
    gone = label_points(pair.A, drive, frames)
    far = nearest_distances(pair.B.points, pair.A.points, _KNOWN_WITHIN)
    new = np.where(np.isinf(far), Label.NEW, Label.KEPT)
    return PairLabels(gone, new.astype(np.uint8))
