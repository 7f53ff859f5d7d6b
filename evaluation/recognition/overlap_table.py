"""The table of overlaps: how much of each query each place shows."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np

from cns_drake.base.csv_files import read_records
from cns_drake.base.errors import InputError
from cns_drake.base.files import completing

_COLUMNS = ("query_frame", "database_frame", "overlap")


def write_overlaps(
    path: Path,
    query_frames: np.ndarray,
    database_frames: np.ndarray,
    overlaps: np.ndarray,
) -> None:
    """Writes the overlap of each query with each place as CSV.

    Columns `query_frame`, `database_frame` and `overlap`, which is empty for a
    query without a point.

    Args:
        path: to write.
        query_frames: (Q,) of the queries.
        database_frames: (D,) of the places.
        overlaps: (Q, D), see `overlap_truth`.

    Raises:
        InputError: if the file cannot be written.
    """
    with (
        completing(path) as part,
        open(part, "w", newline="", encoding="utf-8") as stream,
    ):
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(_COLUMNS)
        for frame, row in zip(query_frames, overlaps, strict=True):
            for place, value in zip(database_frames, row, strict=True):
                text = "" if math.isnan(value) else f"{value:.6f}"
                writer.writerow([frame, place, text])


def read_overlaps(
    path: Path, query_frames: np.ndarray, database_frames: np.ndarray
) -> np.ndarray:
    """Returns the overlaps (Q, D) of a table.

    Args:
        path: of the table.
        query_frames: (Q,) that it must have.
        database_frames: (D,) likewise.

    Raises:
        InputError: the file cannot be read, a number is impossible, or the
            frames are others.
    """
    expected = [
        (int(frame), int(place))
        for frame in query_frames
        for place in database_frames
    ]
    frames, values = [], []
    for line, row in read_records(path, _COLUMNS):
        where = f"{path}: line {line}"
        try:
            frames.append((int(row["query_frame"]), int(row["database_frame"])))
            values.append(float(row["overlap"] or math.nan))
        except ValueError:
            raise InputError(f"{where}: not a number") from None
        if not (math.isnan(values[-1]) or 0.0 <= values[-1] <= 1.0):
            raise InputError(f"{where}: overlap: not between 0 and 1")
    if frames != expected:
        raise InputError(
            f"{path}: query_frame, database_frame: not those of these drives"
            " and spacings"
        )
    return np.reshape(values, (len(query_frames), len(database_frames)))
