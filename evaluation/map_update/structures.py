"""How much each structure of two maps has changed, and a verdict on each."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import NamedTuple

import numpy as np

from evaluation.base import is_there, read_records, whole_number, write_csv
from evaluation.map_update.labels import MOVING_CLASSES, SIDES, Label
from evaluation.map_update.sessions import Session, SessionPair


@dataclass(frozen=True)
class StructureChange:
    """How much a structure of map A or B has changed.

    Attributes:
        side: map in which the structure is, A or B.
        instance: number of the structure in this map.
        structure: name of the structure; empty if unknown.
        semantic_class: name of the structure's class; empty if unknown.
        label: number of the structure's class.
        points: number of the structure's points in the map.
        observed: number of the structure's points that the other drive
            observed.
        changed: number of the observed points that are gone (A) or new (B).
        verdict: gone (A) or new (B) if most of the observed points are gone or
            new, else kept. Without an observed point: unobserved (A) or
            newly_seen (B).
        alone: whether the world of the other drive lacks a structure of this
            name.
    """

    side: str
    instance: int
    structure: str
    semantic_class: str
    label: int
    points: int
    observed: int
    changed: int
    verdict: str
    alone: bool

    @property
    def moves(self) -> bool:
        """Whether the structure is a vehicle or a person."""
        return self.label in MOVING_CLASSES


class Verdicts(NamedTuple):
    """Verdicts on the S structures of a map, in ascending order of numbers.

    Attributes:
        numbers: (S,) numbers of the structures.
        counts: (S, 3) how many points each structure has, how many of them are
            observed, and how many have changed.
        labels: (S,) verdict on each structure, as a `Label`.
    """

    numbers: np.ndarray
    counts: np.ndarray
    labels: np.ndarray


def verdicts(instances: np.ndarray, labels: np.ndarray, side: str) -> Verdicts:
    """Returns a verdict on each structure of a map, such as kept, gone or new.

    A structure is gone or new if more than half of its observed points are gone
    or new.

    Args:
        instances: (N,) number of the structure of each point; 0 for none.
        labels: (N,) label of each point, see
            `evaluation.map_update.labels.Label`.
        side: `A` for the older map, `B` for the newer map.
    """
    unobserved, kept, changed = SIDES[side]
    rows = np.flatnonzero(instances)
    numbers, number_of = np.unique(instances[rows], return_inverse=True)
    chosen = (
        np.ones(len(rows), bool),
        np.isin(labels[rows], (kept, changed)),
        labels[rows] == changed,
    )
    count = np.stack(
        [np.bincount(number_of[c], minlength=len(numbers)) for c in chosen],
        axis=1,
    )
    found = np.where(2 * count[:, 2] > count[:, 1], changed, kept)
    return Verdicts(
        numbers, count, np.where(count[:, 1] == 0, unobserved, found)
    )


def structure_changes(
    pair: SessionPair,
    truth: Sequence[np.ndarray],
    tables: Sequence[Mapping[int, Mapping]],
    present: Sequence[Collection[str]],
) -> list[StructureChange]:
    """Returns how much each structure of both maps has changed.

    A structure that exists in only one of the two worlds is included even if no
    map point lies on it.

    Args:
        pair: both sessions.
        truth: labels of each session.
        tables: instance -> name and class, for each session.
        present: names of the structures in the world of each session.
    """
    rows = []
    for session, labels, names, mine, theirs in zip(
        pair, truth, tables, present, present[::-1], strict=True
    ):
        alone = {
            number
            for number, entry in names.items()
            if entry.get("name") in mine and entry["name"] not in theirs
        }
        rows += _changes_in_map(session, labels, names, alone)
    return rows


def _changes_in_map(
    session: Session,
    labels: np.ndarray,
    names: Mapping[int, Mapping],
    alone: Collection[int],
) -> list[StructureChange]:
    """Returns how much each structure of one map has changed.

    Args:
        session: the session with the map.
        labels: (N,) labels of its points.
        names: instance -> name and class.
        alone: instances that the world of the other drive lacks.
    """
    found = verdicts(session.instances, labels, session.side)
    seen = {
        number: (*counts, verdict)
        for number, counts, verdict in zip(
            *(column.tolist() for column in found), strict=True
        )
    }
    unseen = (0, 0, 0, SIDES[session.side][0])
    rows = []
    for number in sorted({*seen, *alone}):
        entry = names.get(number, {})
        points, observed, changed, verdict = seen.get(number, unseen)
        rows.append(
            StructureChange(
                session.side,
                number,
                str(entry.get("name", "")),
                str(entry.get("class", "")),
                int(entry.get("label", 0)),
                points,
                observed,
                changed,
                Label(verdict).name.lower(),
                number in alone,
            )
        )
    return rows


def write_structures(path: Path, rows: Iterable[StructureChange]) -> None:
    """Writes the table of structures of both maps as CSV."""
    header = [
        field.name.replace("semantic_class", "class")
        for field in fields(StructureChange)
    ]
    write_csv(path, header, map(astuple, rows))


def class_names(folder: Path) -> dict[int, str]:
    """Returns a mapping from the number of a class to the name of the class.

    The names come from the table of structures in a folder. The result is empty
    if the folder has no such table.

    Raises:
        InputError: the table cannot be read.
    """
    path = folder / "structures.csv"
    if not is_there(path):
        return {}
    return {
        whole_number(row["label"], f"{path}: line {line}: label"): row["class"]
        for line, row in read_records(path, ("label", "class"))
        if row["label"]
    }
