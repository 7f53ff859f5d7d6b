"""Scores between folders of single scans, for comparison with other code."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from evaluation.clouds.cloud_files import is_cloud, read_cloud
from evaluation.geometry import points as point_arrays
from evaluation.methods.method import Method
from evaluation.sequences.sampling import crop
from evaluation.support.errors import InputError
from evaluation.support.files import completing
from evaluation.support.progress import Track, silent


def write_scores(
    method: Method,
    database: Path,
    query: Path,
    output: Path,
    track: Track = silent,
) -> int:
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

    Returns:
        How many points were left out as not finite.

    Raises:
        InputError: if a folder or a scan cannot be read, a scan has no point
            within the limits of the protocol, or the output cannot be
            written.
    """
    place_files = _scan_files(database)
    query_files = _scan_files(query)
    num_ignored = 0
    descriptors = []
    for path in track(place_files, "describing places", len(place_files)):
        points, ignored = _read(path)
        descriptors.append(method.describe_place(points))
        num_ignored += ignored
    places = method.build_database(descriptors)
    with (
        completing(output) as part,
        open(part, "w", newline="", encoding="utf-8") as stream,
    ):
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["query", "database", "score"])
        for path in track(query_files, "querying", len(query_files)):
            points, ignored = _read(path)
            num_ignored += ignored
            values = method.score(
                method.describe(points), places, exhaustive=True
            )
            for place, value in zip(place_files, values, strict=True):
                text = "" if np.isnan(value) else repr(float(value))
                writer.writerow([path.stem, place.stem, text])
    return num_ignored


def _read(path: Path) -> tuple[np.ndarray, int]:
    """Returns a cropped scan (N, 3), N > 0, and how many are not finite."""
    points = point_arrays.xyz(read_cloud(path))
    num_finite = int(np.isfinite(points).all(axis=1).sum())
    cropped = crop(points)
    if len(cropped) == 0:
        raise InputError(f"{path}: no finite point within range")
    return cropped, len(points) - num_finite


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
