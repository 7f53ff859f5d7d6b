"""Maps of simulated drives that are updated after each drive."""

from dataclasses import dataclass, field, replace
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
from cns_drake.simulation import SimulationSource
from evaluation.base import Key, Store, doing, exclusive
from evaluation.drives import DriveSource
from evaluation.map_update import (
    NOT_MAINTAINED,
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
from evaluation.study import StudyDrive

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
        store: keeps the updates.
    """

    sources: tuple[DriveSource, ...]
    number: int
    maintain: str
    store: Store = field(compare=False)

    def __call__(self) -> UpkeptDrive:
        made_of, store = self._made_of(), self.store
        key = Key("upkeep", {"updated": made_of}, UPKEEP_VERSION)
        with exclusive(store.part(key).path, lambda: doing("waiting")):
            if not store.has(key):
                found = update_maps(self.sources, self.maintain)
                store.write(key, found)
        drive = self.sources[self.number]()
        return UpkeptDrive(drive, store.read(key), self.number)

    def identity(self) -> list[object]:
        """Returns the identities of the drives, and what updates the map."""
        return [*self._made_of(), self.number, UPKEEP_VERSION]

    def _made_of(self) -> list[object]:
        return [[one.identity() for one in self.sources], self.maintain]


def with_upkept_maps(
    drives: tuple[StudyDrive, ...], maintain: str, store: Store
) -> tuple[StudyDrive, ...]:
    """Returns drives in maps that later drives update."""
    if maintain == NOT_MAINTAINED:
        return drives
    sources = tuple(one.source for one in drives)
    return tuple(
        replace(one, source=UpkeptSource(sources, number, maintain, store))
        for number, one in enumerate(drives)
    )


def plain_source(source: DriveSource) -> SimulationSource:
    """Returns the source of a simulated drive, whatever updates its map."""
    if isinstance(source, UpkeptSource):
        source = source.sources[source.number]
    assert isinstance(source, SimulationSource)
    return source


def update_maps(sources: tuple[DriveSource, ...], maintain: str) -> Updates:
    """Returns the changes that each drive makes to the map of earlier drives.

    Args:
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
