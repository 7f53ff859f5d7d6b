"""Writes training data for place-recognition networks, with ground truth.

The drives are simulated without recording them. Scans of drives through the
same city can match each other. Cities are put far apart, so that their scans
never match.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import itertools
from pathlib import Path
from typing import Literal

import numpy as np

from cns_drake.base import (
    Cluster,
    InputError,
    Job,
    Reporter,
    completing,
    encode_bin,
    make_folder,
    repeated,
    run_jobs,
    track,
    user_errors,
)
from cns_drake.scenarios import Scenario
from cns_drake.scene import CLASS_IDS, GROUND_CLASSES
from cns_drake.simulation import SimulationSource
from cns_drake.studies.exports.pointnetvlad_files import (
    ExportedDrive,
    write_pickles,
)
from cns_drake.studies.ground_truth.exact_overlap import exact_overlaps
from evaluation.drives import cloud_at, sample_frames
from evaluation.maps import downsample
from evaluation.recognition import (
    RetrievalProtocol,
    compared_frames,
    write_overlaps,
)
from evaluation.study import MakePart, Part

Format = Literal["pointnetvlad", "overlap"]

# As in PointNetVLAD (Uy and Lee, CVPR 2018): number of points of a cloud.
_POINTS = 4096
# Clouds are downsampled to this first, so that far walls keep points [m].
_VOXEL = 0.3
_GROUND = np.array(sorted(CLASS_IDS[name] for name in GROUND_CLASSES))
# Expected time to export a drive [s].
_DRIVE_COST = 20.0
# Expected time to compare two drives [s].
_PAIR_COST = 60.0


@dataclass(frozen=True)
class ExportOptions:
    """Settings of the export of each drive.

    Attributes:
        format: program that reads the data: `pointnetvlad`, or `overlap` for
            OverlapNet and similar programs.
        spacing: distance between two clouds, along the path [m].
        scans: number of consecutive scans that are merged into a cloud.
        max_range: largest absolute x, y and z of a point [m]; points beyond
            this limit are left out.
    """

    format: Format = "pointnetvlad"
    spacing: float = 10.0
    scans: int = 1
    max_range: float = 50.0


def write_overlap_table(
    database: Scenario,
    query: Scenario,
    output: Path,
    protocol: RetrievalProtocol,
) -> Path:
    """Writes the exact overlap of each query with each place, as CSV.

    The overlap is the share of a query's points that the LiDAR at the place
    sees. The file is `<output>/overlaps.csv`.

    Args:
        database: the drive of the places, in whose city rays are cast.
        query: the drive of the queries.
        output: the folder, which is created if it does not exist.
        protocol: protocol that determines queries, places and range.

    Raises:
        InputError: the drives are through different maps, or cannot be
            simulated.
    """
    # Before minutes of work.
    make_folder(output)
    places, queries = (SimulationSource(one)() for one in (database, query))
    found = exact_overlaps(places, queries, protocol)
    path = output / "overlaps.csv"
    frames = compared_frames(places, queries, protocol)
    write_overlaps(path, *frames, found)
    return path


def export_pairs(
    scenarios: Sequence[Scenario],
    held_out: Sequence[Scenario],
    output: Path,
    options: ExportOptions,
    cluster: Cluster,
    on_note: Callable[[str], None] = lambda note: None,
) -> list[Path]:
    """Writes training data for other programs; returns the index files.

    The index files name the pairs of scans. Finished drives are not simulated
    again.

    Args:
        scenarios: the drives to learn from.
        held_out: drives for evaluation only. If there are none, all drives are
            used for training and evaluation.
        output: the folder of the set.
        options: format and spacing of the exported clouds.
        cluster: runs the work.
        on_note: is called with notes on missing parts of the set.

    Raises:
        InputError: there is no drive to learn from, two drives have the same
            name, or drives cannot be simulated; the error names all drives that
            cannot be simulated.
    """
    if not scenarios:
        raise InputError("export: no drive to learn from")
    every = [*scenarios, *held_out]
    names = [one.name for one in every]
    for name in repeated(names):
        raise InputError(f"export: two drives are named {name}")
    make_folder(output)
    output = output.absolute()
    parts = {name: Part(output / "parts" / f"{name}.data") for name in names}
    jobs = [
        Job(
            f"export {one.name}",
            MakePart(
                parts[one.name],
                export_run,
                (SimulationSource(one), output / "runs" / one.name, options),
            ),
            cost=_DRIVE_COST,
        )
        for one in every
    ]
    pairs = {}
    cities = [(one.map, one.world) for one in every]
    if options.format == "overlap":
        for i, j in itertools.permutations(range(len(every)), 2):
            if cities[i] == cities[j]:
                name = f"{names[i]} in {names[j]}"
                part = Part(output / "parts" / f"{name}.data")
                both = SimulationSource(every[i]), SimulationSource(every[j])
                step = MakePart(part, compare_runs, (*both, options))
                jobs.append(Job(f"overlap {name}", step, cost=_PAIR_COST))
                pairs[names[i], names[j]] = part
    run_jobs(jobs, cluster)
    runs = {name: np.array(part.read()) for name, part in parts.items()}
    if options.format == "overlap":
        found = {key: part.read() for key, part in pairs.items()}
        return [_write_overlaps(output, runs, found)]
    numbers = list(dict.fromkeys(cities))
    placed = [
        ExportedDrive(f"runs/{name}", runs[name], numbers.index(city))
        for name, city in zip(names, cities, strict=True)
    ]
    learned, tested = placed[: len(scenarios)], placed[len(scenarios) :]
    return write_pickles(output, learned, tested or learned, on_note)


def export_run(
    reporter: Reporter,
    simulation: SimulationSource,
    folder: Path,
    options: ExportOptions,
) -> np.ndarray:
    """Simulates a drive and writes its clouds as files `<number>.bin`.

    Args:
        reporter: reports progress.
        simulation: object that simulates the drive when it is called.
        folder: folder for the files.
        options: format and spacing of the clouds.

    Returns:
        (N, 4, 4) poses X_WS of the LiDAR at the clouds.
    """
    drive = simulation()
    frames = sample_frames(drive.X_WS[:, :3, 3], options.spacing)
    make_folder(folder)
    before = options.scans // 2
    for number, frame in enumerate(
        track(frames, f"writing {drive.name}", len(frames), "scans")
    ):
        if options.format == "overlap":
            data = encode_bin(drive.scan(int(frame)))
        else:
            cloud = cloud_at(
                drive,
                int(frame),
                options.scans,
                options.max_range,
                ("label",),
                before,
            )
            data = _training_cloud(cloud, options.max_range, number).tobytes()
        with user_errors(folder):
            (folder / f"{number:06d}.bin").write_bytes(data)
    X_WS = drive.X_WS[frames]
    with completing(folder / "poses.txt") as part:
        np.savetxt(part, X_WS[:, :3].reshape(-1, 12), fmt="%.9g")
    return X_WS


def _training_cloud(
    points: np.ndarray, max_range: float, seed: int
) -> np.ndarray:
    """Returns 4096 points in [-1, 1], without ground, of mean 0; float64."""
    kept = points[~np.isin(points["label"], _GROUND)]
    xyz = np.stack([kept[axis] for axis in "xyz"], axis=1)
    xyz = downsample(xyz, _VOXEL)
    if len(xyz) == 0:
        return np.zeros((_POINTS, 3))
    rng = np.random.default_rng(seed)
    few = len(xyz) < _POINTS
    chosen = xyz[rng.choice(len(xyz), _POINTS, replace=few)]
    return (chosen - chosen.mean(axis=0)) / (2.0 * max_range)


def compare_runs(
    reporter: Reporter,
    query: SimulationSource,
    database: SimulationSource,
    options: ExportOptions,
) -> np.ndarray:
    """Returns the exact overlap of Q queries with D places, (Q, D).

    The overlap is the share of a query's points that the LiDAR at the place
    sees.

    Args:
        reporter: reports progress.
        query: the drive of the queries.
        database: the drive of the places.
        options: the spacing of queries and places, and the greatest range.
    """
    protocol = RetrievalProtocol(
        query_spacing=options.spacing,
        place_spacing=options.spacing,
        max_range=options.max_range,
    )
    return exact_overlaps(database(), query(), protocol)


def _write_overlaps(
    output: Path,
    runs: Mapping[str, np.ndarray],
    found: Mapping[tuple[str, str], np.ndarray],
) -> Path:
    """Writes all overlaps that are not zero, as in OverlapNet's training data.

    A row of the array `overlaps` (N, 4) contains the query's number, the
    place's number, their overlap and the query's yaw in the place's frame
    [rad]. A row of `seq` (N, 2) contains the names of the two drives.
    """
    rows, drives = [], []
    for (query, database), overlaps in found.items():
        asked, placed = np.nonzero(overlaps > 0.0)
        R_PQ = np.einsum(
            "nji,njk->nik",
            runs[database][placed, :3, :3],
            runs[query][asked, :3, :3],
        )
        yaw = np.arctan2(R_PQ[:, 1, 0], R_PQ[:, 0, 0])
        values = overlaps[asked, placed]
        rows.append(np.stack([asked, placed, values, yaw], axis=1))
        drives += [(query, database)] * len(asked)
    path = output / "overlaps.npz"
    with completing(path) as part, open(part, "wb") as stream:
        np.savez_compressed(
            stream,
            overlaps=np.concatenate(rows) if rows else np.zeros((0, 4)),
            seq=np.array(drives, dtype=str).reshape(-1, 2),
        )
    return path
