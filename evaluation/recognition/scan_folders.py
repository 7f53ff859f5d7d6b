"""Scores between folders of single scans, for comparison with other code."""

import csv
from pathlib import Path

import numpy as np

from evaluation.base import (
    InputError,
    completing,
    listed,
    quoted_cell,
    read_only,
    track,
    xyz,
)
from evaluation.clouds import OnNote, is_cloud, no_note, read_cloud
from evaluation.drives import NOT_FINITE, cropped, cropped_with_fields
from evaluation.methods import Method
from evaluation.recognition.geometric_verification import verified_scores
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.scoring import score_places


def write_scores(
    method: Method,
    database: Path,
    query: Path,
    output: Path,
    *,
    verification_radius: float | None = None,
    columns: int | None = None,
    on_note: OnNote = no_note,
) -> None:
    """Writes the score of every query with every place as CSV.

    Columns are `query`, `database` (file stems) and `score`, which is empty if
    the place is no candidate. Rows are sorted by the names of query and place.
    The file appears under its name only when it is complete. A method with its
    own `score_in_drive` gets the queries as if one drive contained them, in the
    order of their names.

    Args:
        method: method that describes and compares the scans.
        database: folder of the scans of places, one file each.
        query: folder of the scans of queries, one file each.
        output: the file to write.
        verification_radius: radius of geometric verification [m] (see
            `evaluation.recognition.geometric_verification`); None for scores
            without this verification.
        columns: number of columns of `.bin` files, see `read_cloud`.
        on_note: is called with notes on how scans were read, one note of each
            kind, and on what the method assumes.

    Raises:
        InputError: if the method combines queries (`center_scores` needs all
            queries at once), a folder or a scan cannot be read, a scan has no
            point within the limits of the protocol, or the output cannot be
            written.
    """
    if method.config.center_scores:
        raise InputError(
            f"{method.name}: center_scores: needs all queries at once, and"
            " scans in folders are compared one by one"
        )
    place_files = _scan_files(database)
    query_files = _scan_files(query)
    reader = _CloudReader(method, _first_of_each_kind(on_note))
    descriptors, clouds = [], []
    for path in track(
        place_files, "describing places", len(place_files), "scans"
    ):
        cloud = reader.read(path, columns)
        descriptors.append(method.describe_place(cloud))
        if method.rerank_best:
            clouds.append(cloud)
    places = method.build_database(descriptors)
    is_known = np.ones(len(place_files), dtype=bool)
    queries: list = []
    with (
        completing(output) as part,
        open(part, "w", newline="", encoding="utf-8") as stream,
    ):
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["query", "database", "score"])
        for path in track(query_files, "querying", len(query_files), "scans"):
            cloud = reader.read(path, columns)
            queries.append(method.describe(cloud))
            values = score_places(
                method,
                queries,
                cloud,
                places,
                clouds,
                is_known,
                exhaustive=True,
                where=str(path),
            )
            if verification_radius is not None:
                values = verified_scores(
                    method, queries[-1], places, values, verification_radius
                )
            for place, value in zip(place_files, values, strict=True):
                text = "" if np.isnan(value) else repr(float(value))
                names = quoted_cell(path.stem), quoted_cell(place.stem)
                writer.writerow([*names, text])
    if reader.num_ignored:
        on_note(f"{reader.num_ignored} {NOT_FINITE}")
    if (assumed := method.assumption(None)) is not None:
        on_note(assumed)


def _first_of_each_kind(on_note: OnNote) -> OnNote:
    """Returns a function that passes on only the first note of each kind.

    Notes are of one kind if they differ only in the name of the file.
    """
    seen: set[str] = set()

    def pass_on(note: str) -> None:
        kind = note.rpartition(": ")[2]
        if kind not in seen:
            seen.add(kind)
            on_note(note)

    return pass_on


class _CloudReader:
    """Reads clouds for a method, and counts the points that are not finite."""

    def __init__(self, method: Method, on_note: OnNote):
        """Starts without a cloud.

        Args:
            method: the method that will describe the clouds.
        """
        self.num_ignored = 0
        self._method = method
        self._on_note = on_note

    def read(self, path: Path, columns: int | None) -> np.ndarray:
        """Returns the cloud in a file, cropped to the protocol's range.

        Args:
            columns: number of columns if it is a `.bin` file.

        Returns:
            (N, 3) float64 points [m], N > 0; for a method with further fields,
            a structured array (N,). The array is read-only.
        """
        scan = read_cloud(path, columns, self._on_note)
        is_finite = np.isfinite(xyz(scan)).all(axis=1)
        self.num_ignored += int(np.count_nonzero(~is_finite))
        half_extent = RetrievalProtocol.half_extent
        if fields := self._method.point_fields:
            cloud = cropped_with_fields(
                scan, half_extent, fields, source=str(path)
            )
        else:
            cloud = cropped(scan, half_extent)
        if len(cloud) == 0:
            raise InputError(f"{path}: no finite point within range")
        return read_only(cloud)


def _scan_files(folder: Path) -> list[Path]:
    """Returns the files of the clouds in a folder, sorted by name."""
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder")
    files = [path for path in listed(folder) if is_cloud(path)]
    if not files:
        raise InputError(f"{folder}: no scan in it (.bin .pcd .npy .ply)")
    stems = set()
    for path in files:
        if path.stem in stems:
            raise InputError(f"{path}: another scan has the same name")
        stems.add(path.stem)
    return files
