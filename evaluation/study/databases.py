"""Databases of several drives: places in one world, and distractors."""

from collections.abc import Sequence
from functools import partial
import math
from typing import NamedTuple

import numpy as np

from evaluation.recognition import (
    KEEP_ALL,
    MOST_BYTES,
    DriveDescriptors,
    StoredDrives,
    joined_scans,
    kept_places,
)
from evaluation.study.storage.parts import Part


class Searched(NamedTuple):
    """A database that is searched: places of one drive or of several.

    Attributes:
        described: the described places.
        drives: name of each place's drive.
        num_here: number of places in the query's own world; they come first.
        rows: (num_here,) for each of the first `num_here` places, its index
            among all places of the drives through the query's world. (The
            database may contain only some of these places.)
    """

    described: DriveDescriptors
    drives: list[str]
    num_here: int
    rows: np.ndarray


def searched_database(
    database: DriveDescriptors | Part,
    distractors: Sequence[Part],
    num_distractors: int,
    beside: Sequence[Part] = (),
    keep: str | int = KEEP_ALL,
    cell: float = math.inf,
    *,
    divides: bool = False,
) -> Searched:
    """Returns a database of one drive, with the places of other drives.

    The drives through other cities are moved so far away that none of their
    places is a match. The first `num_distractors` places of these drives are
    appended, or all places if there are fewer.

    Args:
        database: a drive with a method's descriptors of its places, or the file
            that contains this drive.
        distractors: for each drive through another city, the file with the
            same method's descriptors of its places.
        num_distractors: number of places to append.
        beside: files with the same method's descriptors of further drives in
            the same world, from older to newer. All of their places come before
            the places of other cities.
        keep: which places in this world are kept, see `kept_places`.
        cell: side of the cells by which places are kept [m].
        divides: whether descriptors are read while they are searched, if they
            are too large for the memory; see `Method.divides`.
    """
    parts = [database, *beside, *distractors]
    store = StoredDrives(
        [partial(_descriptors_of, one) for one in parts],
        [one.size() if isinstance(one, Part) else 0 for one in parts],
        MOST_BYTES if divides else math.inf,
    )
    num_near = 1 + len(beside)
    near = [store.undescribed(k) for k in range(num_near)]
    here = joined_scans(near, [0] * num_near)
    lengths = [len(one.frames) for one in near]
    drive_of = np.repeat(np.arange(num_near), lengths)
    own_row = np.concatenate([np.arange(length) for length in lengths])
    rows = np.flatnonzero(kept_places(here.p_WSs, drive_of, keep, cell))
    every = [here if len(rows) == len(drive_of) else here.chosen(rows)]
    stored = [drive_of[rows]]
    stored_rows = [own_row[rows]]
    most = len(rows) + num_distractors
    for k in range(num_near, len(parts)):
        if sum(map(len, stored)) >= most:
            break
        every.append(store.undescribed(k))
        stored_rows.append(np.arange(len(every[-1].frames)))
        stored.append(np.full(len(stored_rows[-1]), k))
    places = joined_scans(every, range(len(every)), most)
    of = np.concatenate(stored)[:most]
    return Searched(
        DriveDescriptors(
            store.name(0),
            store.described(places, of, np.concatenate(stored_rows)[:most]),
            here.chosen(np.arange(0)),
        ),
        [store.name(k) for k in of.tolist()],
        len(rows),
        rows,
    )


def _descriptors_of(source: DriveDescriptors | Part) -> DriveDescriptors:
    """Returns descriptors, which may be in a file."""
    return source.read()[1] if isinstance(source, Part) else source
