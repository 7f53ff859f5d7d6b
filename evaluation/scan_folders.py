"""Scores between folders of single scans, for comparison with other code."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from evaluation import points as point_arrays
from evaluation.errors import InputError
from evaluation.files import completing
from evaluation.methods.method import Method
from evaluation.progress import Track, silent
from evaluation.retrieval import crop
from evaluation.sequences.clouds import is_cloud, read_cloud


def write_scores(
    method: Method,
    database: Path,
    query: Path,
    output: Path,
    track: Track = silent,
) -> None:
    """Writes the score of every query with every place as CSV.

    Columns `query`, `database` (file stems) and `score`, which is empty
    where the method finds no candidate; rows by query, then by place, both
    by name. The file appears under its name only when it is complete.

    Args:
        method: describes and compares.
        database: folder of scans, one a file.
        query: likewise.
        output: the file to write.
        track: reports progress.

    Raises:
        InputError: if a folder or a scan cannot be read, or the output not
            be written.
    """
    place_files = _scan_files(database)
    query_files = _scan_files(query)
    places = method.build_database(
        [
            method.describe_place(_read(path))
            for path in track(
                place_files, "describing places", len(place_files)
            )
        ]
    )
    with (
        completing(output) as part,
        open(part, "w", newline="", encoding="utf-8") as stream,
    ):
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["query", "database", "score"])
        for path in track(query_files, "querying", len(query_files)):
            values = method.score(
                method.describe(_read(path)), places, exhaustive=True
            )
            for place, value in zip(place_files, values, strict=True):
                text = "" if np.isnan(value) else repr(float(value))
                writer.writerow([path.stem, place.stem, text])


def _read(path: Path) -> np.ndarray:
    points = crop(point_arrays.xyz(read_cloud(path)))
    if len(points) == 0:
        raise InputError(f"{path}: no finite point within range")
    return points


def _scan_files(folder: Path) -> list[Path]:
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder")
    files = sorted(path for path in folder.iterdir() if is_cloud(path))
    if not files:
        raise InputError(f"{folder}: no scan in it (.bin .pcd .npy .ply)")
    stems = set()
    for path in files:
        if path.stem in stems:
            raise InputError(f"{path}: another scan has the same name")
        stems.add(path.stem)
    return files
