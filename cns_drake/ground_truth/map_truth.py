"""Writes the maps of two drives, with exact labels of what changed."""

import base64
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import io
from pathlib import Path

import jinja2
import numpy as np

from cns_drake.ground_truth.exact_labels import label_points
from cns_drake.ground_truth.labelled import LabelledDrive, open_labelled
from evaluation.base import (
    GONE_RGB,
    NEW_RGB,
    UNSEEN_RGB,
    InputError,
    draft_folder,
    write_text,
)
from evaluation.drives import check_same_world
from evaluation.map_update import (
    SIDES,
    SPACING,
    Label,
    SessionPair,
    StructureChange,
    structure_changes,
    write_labels,
    write_session,
    write_structures,
)


@dataclass(frozen=True)
class Truth:
    """The ground truth of one of two maps.

    Attributes:
        points: name of a label -> number of the map's points that have it.
        structures: the change of each structure.
    """

    points: Mapping[str, int]
    structures: Sequence[StructureChange]

    def alone(self) -> tuple[int, int, int]:
        """Counts the structures that are in this drive's world alone.

        Returns:
            How many there are, how many of them are in the map, and how many
            of these are gone or new.
        """
        found = [row for row in self.structures if row.alone and not row.moves]
        return (
            len(found),
            sum(row.points > 0 for row in found),
            sum(row.verdict in ("gone", "new") for row in found),
        )


def write_truth(
    older: LabelledDrive | str | Path,
    newer: LabelledDrive | str | Path,
    output: Path,
    spacing: float = SPACING,
    *,
    across_maps: bool = False,
) -> dict[str, Truth]:
    """Writes the maps of two drives, with exact labels of what changed.

    `evaluation.map_update.sessions` describes the files of the maps. The files
    `structures.csv` and `index.html` show how much of each structure is gone or
    new.

    Args:
        older: the drive A, or what `open_labelled` opens.
        newer: the drive B, in the same way.
        output: the folder to write, new or empty.
        spacing: distance driven between two scans [m].
        across_maps: whether the drives' maps may have different names, as an
            aged map has.

    Returns:
        The ground truth of the maps A and B.

    Raises:
        InputError: the drives are of different worlds, or the folder cannot be
            written.
    """
    with draft_folder(output) as draft:
        a, b = (
            one if isinstance(one, LabelledDrive) else open_labelled(one)
            for one in (older, newer)
        )
        check_same_world(a.drive, b.drive, across_maps=across_maps)
        _check_same_map(a, b)
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
        _write_page(
            draft / "index.html",
            pair,
            truth,
            table,
            (a.drive.name, b.drive.name),
        )
    return {
        side: Truth(
            {
                Label(label).name.lower(): number
                for label, number in sorted(Counter(labels.tolist()).items())
            },
            [row for row in table if row.side == side],
        )
        for side, labels in zip(SIDES, truth, strict=True)
    }


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


# Drawing order of the labels: changes are on top.
_RGB = {
    Label.UNOBSERVED: UNSEEN_RGB,
    Label.NEWLY_SEEN: UNSEEN_RGB,
    Label.KEPT: (90, 96, 104),
    Label.GONE: GONE_RGB,
    Label.NEW: NEW_RGB,
}
_WORDS = {
    Label.UNOBSERVED: "unobserved: B's drive did not look there",
    Label.KEPT: "kept",
    Label.GONE: "gone",
    Label.NEW: "new",
    Label.NEWLY_SEEN: "newly seen: A's drive did not look there",
}
# Longest side of a picture [pixels].
_LONGEST_SIDE = 1600
# Smallest side of a pixel [m].
_SMALLEST_PIXEL = 0.2
# Structures in the page's table, the largest changes first.
_MOST_ROWS = 200


def _write_page(
    path: Path,
    pair: SessionPair,
    truth: Sequence[np.ndarray],
    table: Sequence[StructureChange],
    names: tuple[str, str],
) -> None:
    """Writes a web page with two labelled maps and their changed structures.

    Args:
        path: path of the page.
        pair: the maps of A and B, which the page shows from above.
        truth: labels of the points of each map.
        names: names of the two drives.
    """
    low, step, shape = _picture_frame(pair)
    maps = []
    for session, labels, name in zip(pair, truth, names, strict=True):
        counts = ", ".join(
            f"{(labels == label).sum():,} "
            f"{label.name.lower().replace('_', ' ')}"
            for label in _RGB
            if (labels == label).any()
        )
        image = _map_image(session.points, labels, low, step, shape)
        maps.append((session.side, name, counts, _base64_png(image)))
    rows = sorted(
        (row for row in table if row.verdict in ("gone", "new")),
        key=lambda row: -row.changed,
    )[:_MOST_ROWS]
    template = Path(__file__).with_suffix(".html").read_text("utf-8")
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined
    )
    text = environment.from_string(template).render(
        names=names,
        legend=[(_RGB[label], words) for label, words in _WORDS.items()],
        maps=maps,
        rows=rows,
    )
    write_text(path, f"{text}\n")


def _picture_frame(
    pair: SessionPair,
) -> tuple[np.ndarray, float, tuple[int, int]]:
    """Returns the corner [m], pixel side [m], rows and columns of a picture."""
    points = np.concatenate([one.points[:, :2] for one in pair])
    if len(points) == 0:
        points = np.zeros((1, 2))
    # A few far points would make the streets small.
    low, high = np.percentile(points, (0.2, 99.8), axis=0)
    step = max(float((high - low).max()) / _LONGEST_SIDE, _SMALLEST_PIXEL)
    columns, rows = np.ceil((high - low) / step).astype(int) + 1
    return low, step, (int(rows), int(columns))


def _map_image(
    points: np.ndarray,
    labels: np.ndarray,
    low: np.ndarray,
    step: float,
    shape: tuple[int, int],
) -> np.ndarray:
    """Returns the map from above, (rows, columns, 3) uint8, north up."""
    image = np.full((*shape, 3), 255, np.uint8)
    columns, rows = ((points[:, :2] - low) / step).astype(int).T
    inside = (columns >= 0) & (columns < shape[1])
    inside &= (rows >= 0) & (rows < shape[0])
    for label, rgb in _RGB.items():
        chosen = inside & (labels == label)
        image[shape[0] - 1 - rows[chosen], columns[chosen]] = rgb
    return image


def _base64_png(image: np.ndarray) -> str:
    from matplotlib.image import imsave

    stream = io.BytesIO()
    imsave(stream, image)
    return base64.b64encode(stream.getvalue()).decode()
