"""Writes the maps of two drives, with exact labels of what changed."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from cns_drake.base import InputError, draft_folder, user_errors
from cns_drake.drives import check_same_world
from cns_drake.studies.ground_truth.exact_labels import label_points
from cns_drake.studies.ground_truth.labelled_drive import LabelledDrive
from cns_drake.studies.ground_truth.map_truth_page import write_page
from evaluation.map_update import (
    SIDES,
    SPACING,
    SessionPair,
    StructureChange,
    structure_changes,
    write_labels,
    write_session,
    write_structures,
)


def write_truth(
    a: LabelledDrive,
    b: LabelledDrive,
    output: Path,
    spacing: float = SPACING,
    *,
    across_maps: bool = False,
) -> tuple[Mapping[str, Counter[int]], list[StructureChange]]:
    """Writes the maps of two drives, with exact labels of what changed.

    `evaluation.map_update.sessions` describes the files of the maps. The files
    `structures.csv` and `index.html` show how much of each structure is gone or
    new.

    Args:
        a: the older drive A.
        b: the newer drive B.
        output: the folder to write, new or empty.
        spacing: distance driven between two scans [m].
        across_maps: whether the drives' maps may have different names, as an
            aged map has.

    Returns:
        The counts of points, and a list with the change of each structure. The
        counts map A and B to a mapping from each label to the number of the
        map's points with this label.

    Raises:
        InputError: the drives are of different worlds, or the folder cannot be
            written.
    """
    check_same_world(a.drive, b.drive, across_maps=across_maps)
    _check_same_map(a, b)
    with user_errors(output):
        if output.exists() and (not output.is_dir() or any(output.iterdir())):
            raise InputError(f"{output}: exists already; give a new folder")
    with draft_folder(output) as draft:
        sessions, frames = [], []
        for side, one in zip(SIDES, (a, b), strict=True):
            session, taken = write_session(one.drive, draft / side, spacing)
            sessions.append(session)
            frames.append(taken)
        pair = SessionPair(*sessions)
        truth = (
            label_points(pair.A, b, frames[1]),
            label_points(pair.B, a, frames[0]),
        )
        for session, labels in zip(pair, truth, strict=True):
            write_labels(session.folder / "truth.npy", labels)
        names = [one.drive.instances or {} for one in (a, b)]
        present = [one.simulated.structures for one in (a, b)]
        table = structure_changes(pair, truth, names, present)
        write_structures(draft / "structures.csv", table)
        write_page(
            draft / "index.html",
            pair,
            truth,
            table,
            (a.drive.name, b.drive.name),
        )
    counts = {
        side: Counter(labels.tolist())
        for side, labels in zip(SIDES, truth, strict=True)
    }
    return counts, table


def _check_same_map(a: LabelledDrive, b: LabelledDrive) -> None:
    """Refuses drives of two map folders, even if the folders' names are equal.

    For worlds without a map folder this cannot be checked; the user must make
    sure that both show the same place.
    """
    if (a.scenario.map is None) != (b.scenario.map is None):
        raise InputError(
            f"{b.drive.name}: one drive is through a map, the other through a "
            "world; give two of one place"
        )
