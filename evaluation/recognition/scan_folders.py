"""Scores between folders of single scans, for comparison with other code."""

import csv
from pathlib import Path

import numpy as np

from cns_drake.base import points as point_arrays
from cns_drake.base.complete_files import completing
from cns_drake.base.errors import InputError
from cns_drake.base.listing import listed
from cns_drake.base.progress import track
from evaluation.clouds.bin_columns import find_layout
from evaluation.clouds.cloud_files import is_cloud, read_cloud
from evaluation.clouds.notes import OnNote, no_note
from evaluation.drives.scan_clouds import cropped, cropped_with_fields
from evaluation.methods.method import Method
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.scoring import score_places


def write_scores(
    method: Method,
    database: Path,
    query: Path,
    output: Path,
    *,
    gate_radius: float | None = None,
    columns: int | None = None,
    on_note: OnNote = no_note,
) -> int:
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
        gate_radius: radius of geometric verification [m] (see
            `evaluation.recognition.geometric_verification`); None for scores
            without this verification.
        columns: number of columns of `.bin` files; by default guessed for each
            folder from the values.
        on_note: is called with notes on how scans were read, one note of each
            kind.

    Returns:
        The number of points left out because they are not finite.

    Raises:
        InputError: if the method's setting `sequence` is not 0 (this setting
            needs the poses of scans), a folder or a scan cannot be read, a scan
            has no point within the limits of the protocol, or the output cannot
            be written.
    """
    if method.config.sequence:
        raise InputError(
            f"{method.name}: sequence: needs the poses of scans, which a"
            " folder of scans does not have"
        )
    place_files = _scan_files(database)
    query_files = _scan_files(query)
    place_columns = _num_columns(place_files, columns, on_note)
    query_columns = _num_columns(query_files, columns, on_note)
    on_note = _first_of_each_kind(on_note)
    num_ignored = 0
    descriptors, clouds = [], []
    for path in track(
        place_files, "describing places", len(place_files), "scans"
    ):
        cloud, ignored = _read_cropped(path, method, place_columns, on_note)
        descriptors.append(method.describe_place(cloud))
        if method.rerank_best:
            clouds.append(cloud)
        num_ignored += ignored
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
            cloud, ignored = _read_cropped(path, method, query_columns, on_note)
            num_ignored += ignored
            queries.append(method.describe(cloud))
            values = score_places(
                method,
                queries,
                cloud,
                places,
                clouds,
                is_known,
                gate_radius=gate_radius,
                exhaustive=True,
                where=str(path),
            )
            for place, value in zip(place_files, values, strict=True):
                text = "" if np.isnan(value) else repr(float(value))
                writer.writerow([path.stem, place.stem, text])
    return num_ignored


def _num_columns(
    files: list[Path], columns: int | None, on_note: OnNote
) -> int | None:
    """Returns the number of columns of `.bin` files; None if there are none."""
    bins = [path for path in files if path.suffix.lower() == ".bin"]
    if not bins:
        return None
    layout = find_layout(bins, columns)
    if layout.note:
        on_note(layout.note)
    return layout.columns


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


def _read_cropped(
    path: Path, method: Method, columns: int | None, on_note: OnNote
) -> tuple[np.ndarray, int]:
    """Returns a cropped cloud, N > 0, and its number of non-finite points."""
    scan = read_cloud(path, columns, on_note)
    points = point_arrays.xyz(scan)
    num_finite = int(np.isfinite(points).all(axis=1).sum())
    max_range = RetrievalProtocol.max_range
    if method.point_fields:
        cloud = cropped_with_fields(
            scan, max_range, method.point_fields, source=str(path)
        )
    else:
        cloud = cropped(scan, max_range)
    if len(cloud) == 0:
        raise InputError(f"{path}: no finite point within range")
    return point_arrays.read_only(cloud), len(points) - num_finite


def _scan_files(folder: Path) -> list[Path]:
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
