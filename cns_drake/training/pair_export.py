"""Writes training data for place-recognition networks, with ground truth.

The drives are simulated without recording them. Scans of drives through the
same city can match each other. Cities are put far apart, so that their scans
never match.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import itertools
from pathlib import Path
import pickle
import sys
import types
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from cns_drake.export import claim_folder
from cns_drake.scenarios import load_scenario
from cns_drake.simulation import SimulationSource
from cns_drake.studies import named_drives
from evaluation.base import (
    Cluster,
    InputError,
    Job,
    MakePart,
    Part,
    Reporter,
    completing,
    make_folder,
    repeated,
    run_jobs,
    track,
    user_errors,
)
from evaluation.drives import cloud_at, sample_frames
from evaluation.maps import downsample
from worlds.shapes import CLASS_IDS, GROUND_CLASSES

# File or folder of a set of training data -> content.
_EXPLAINED = {
    "runs/NAME/NUMBER.bin": "clouds of the drive NAME, float64 x y z",
    "runs/NAME/poses.txt": "poses of the LiDAR at the clouds, 3 x 4",
    "*.pickle": "positives and negatives of each cloud",
    "parts": "what another run need not compute again",
}

# As in PointNetVLAD (Uy and Lee, CVPR 2018): number of points of a cloud.
_POINTS = 4096
# Clouds are downsampled to this first, so that far walls keep points [m].
_VOXEL = 0.3
_GROUND = np.array(sorted(CLASS_IDS[name] for name in GROUND_CLASSES))


@dataclass(frozen=True)
class ExportOptions:
    """Settings of the export of each drive.

    Attributes:
        spacing: distance between two clouds, along the path [m].
        scans: number of consecutive scans that are merged into a cloud.
        half_extent: largest absolute x, y and z of a point [m]; points beyond
            this limit are left out.
    """

    spacing: float = 10.0
    scans: int = 1
    half_extent: float = 50.0


def write_pairs(
    drives: Sequence[str],
    held_out: Sequence[str],
    output: Path,
    options: ExportOptions,
    cluster: Cluster,
    *,
    vary: str | None = None,
    on_note: Callable[[str], None] = lambda note: None,
) -> list[Path]:
    """Writes training data for other programs; returns the index files.

    The index files are PointNetVLAD's pickles, as `write_pickles` writes them.
    Finished drives are not simulated again.

    Args:
        drives: names of shipped drives, or scenario files. If none is given,
            these are the drives of `vary`, or all shipped drives.
        held_out: drives for evaluation only, even if `drives` or `vary` names
            them. If there are none, all drives are used for training and
            evaluation.
        output: the folder of the set.
        options: spacing and extent of the exported clouds.
        cluster: runs the work.
        vary: experiment whose drives are added, if any; see `named_drives`.
        on_note: is called with notes on missing parts of the set.

    Raises:
        InputError: a drive or `vary` cannot be used, there is no drive to
            learn from, two drives have the same name, or drives cannot be
            simulated (the error names all of these), or the folder contains
            anything but an earlier set, or cannot be written.
    """
    if vary is not None:  # Its scenarios are written to the same folder.
        _claim(output)
    tested = [load_scenario(name) for name in held_out]
    left_out = {one.name for one in tested}
    named = named_drives(drives, vary, output, cluster)
    learned = [one for one in named if one.name not in left_out]
    if not learned:
        raise InputError("export: no drive to learn from")
    every = [*learned, *tested]
    names = [one.name for one in every]
    for name in repeated(names):
        raise InputError(f"export: two drives are named {name}")
    _claim(output)
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
        )
        for one in every
    ]
    cities = [(one.map, one.world) for one in every]
    run_jobs(jobs, cluster)
    runs = {name: np.array(part.read()) for name, part in parts.items()}
    numbers = list(dict.fromkeys(cities))
    placed = [
        ExportedDrive(f"runs/{name}", runs[name], numbers.index(city))
        for name, city in zip(names, cities, strict=True)
    ]
    first = len(learned)
    return write_pickles(
        output, placed[:first], placed[first:] or placed, on_note
    )


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
        options: spacing and extent of the clouds.

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
        cloud = cloud_at(
            drive,
            int(frame),
            options.scans,
            options.half_extent,
            ("label",),
            before,
        )
        data = _training_cloud(cloud, options.half_extent, number).tobytes()
        with user_errors(folder):
            (folder / f"{number:06d}.bin").write_bytes(data)
    X_WS = drive.X_WS[frames]
    with completing(folder / "poses.txt") as part:
        np.savetxt(part, X_WS[:, :3].reshape(-1, 12), fmt="%.9g")
    return X_WS


def _training_cloud(
    points: np.ndarray, half_extent: float, seed: int
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
    return (chosen - chosen.mean(axis=0)) / (2.0 * half_extent)


# Added to the northing of each further city [m].
_CITY_DISTANCE = 100_000.0
# As in PointNetVLAD (Uy and Lee, CVPR 2018): radius of positives [m].
_POSITIVE_RADIUS = 10.0
# As there: radius of what is no negative [m].
_NON_NEGATIVE_RADIUS = 50.0
# As there: radius of matches in the evaluation [m].
_MATCH_RADIUS = 25.0
# Names of the sets that MinkLoc3Dv2's evaluation reads, one city each.
_LOCATIONS = ("oxford", "university", "residential", "business")
# Number of nearest places that this evaluation asks for.
_ASKED = 25
# Module of the class that training programs unpickle.
_MODULE = "datasets.base_datasets"


@dataclass(frozen=True)
class ExportedDrive:
    """An exported drive with N clouds.

    Attributes:
        folder: folder of the clouds, relative to the data set's folder.
        X_WS: (N, 4, 4) poses of the LiDAR at the clouds, in the city's world.
        city: number of the city, from 0. The northings of its clouds are
            increased by `city * CITY_DISTANCE`, so that clouds of different
            cities never match.
    """

    folder: str
    X_WS: np.ndarray
    city: int

    @property
    def positions(self) -> np.ndarray:
        """(N, 2) northing and easting of the clouds [m]."""
        north_east = self.X_WS[:, [1, 0], 3]
        return north_east + np.array([_CITY_DISTANCE * self.city, 0.0])

    @property
    def files(self) -> list[str]:
        """File names of the drive's clouds, relative to the data set."""
        return [f"{self.folder}/{k:06d}.bin" for k in range(len(self.X_WS))]


def write_pickles(
    output: Path,
    learned: Sequence[ExportedDrive],
    tested: Sequence[ExportedDrive],
    on_note: Callable[[str], None],
) -> list[Path]:
    """Writes the pickles of PointNetVLAD, as MinkLoc3Dv2 reads them.

    Args:
        output: folder of the data set.
        learned: the drives to learn from.
        tested: the drives of the evaluation.
        on_note: is called with notes on clouds and cities that are of no use.

    Returns:
        The pickles that cover all drives; pickles of single cities are not
        listed.
    """
    contents: dict[str, Any] = {}
    for name, runs in (("training", learned), ("test", tested)):
        tuples = contents[f"{name}_queries_baseline2"] = training_tuples(runs)
        alone = sum(not len(one.positives) for one in tuples.values())
        if alone:
            # The sampler of MinkLoc3Dv2 passes over them.
            on_note(
                f"{name}: {alone} of {len(tuples)} clouds have no other within"
                f" {_POSITIVE_RADIUS:g} m; nothing is learned of them"
            )
    every_drive = list(contents)
    by_location = {"": tested} | _locations(tested, on_note)
    for location, runs in by_location.items():
        prefix = f"{location}_" if location else ""
        names = [f"{prefix}evaluation_{one}" for one in ("database", "query")]
        contents |= dict(zip(names, evaluation_sets(runs), strict=True))
        every_drive += [] if location else names
    for name, values in contents.items():
        path = output / f"{name}.pickle"
        with completing(path) as part, open(part, "wb") as stream:
            pickle.dump(values, stream, protocol=pickle.HIGHEST_PROTOCOL)
    return [output / f"{name}.pickle" for name in every_drive]


def _claim(output: Path) -> None:
    """Makes the folder of a set of training data, before minutes of work."""
    claim_folder(output, "pointnetvlad", _EXPLAINED)


def _locations(
    runs: Sequence[ExportedDrive], on_note: Callable[[str], None]
) -> dict[str, list[ExportedDrive]]:
    """Returns the drives of each location of MinkLoc3Dv2's evaluation.

    A location is a city; if there are fewer cities than locations, some cities
    occur twice. The evaluation divides by the number of pairs of drives and,
    for each pair, by the number of queries with a match. Cities where one of
    these numbers is 0 are left out, with a note. If no city is left, there is
    no location.
    """
    cities: dict[int, list[ExportedDrive]] = {}
    for run in runs:
        cities.setdefault(run.city, []).append(run)
    usable = []
    for drives in cities.values():
        fault = _evaluation_fault(drives)
        if fault is None:
            usable.append(drives)
        else:
            on_note(f"not for MinkLoc3Dv2's evaluation: {fault}")
    if len(usable) > len(_LOCATIONS):
        on_note(
            f"MinkLoc3Dv2's evaluation has the first {len(_LOCATIONS)} of"
            f" {len(usable)} cities"
        )
    return {
        location: usable[k % len(usable)]
        for k, location in enumerate(_LOCATIONS)
        if usable
    }


def _evaluation_fault(drives: Sequence[ExportedDrive]) -> str | None:
    """Returns why MinkLoc3Dv2 cannot evaluate a city; None if it can."""
    names = [run.folder.removeprefix("runs/") for run in drives]
    if len(drives) < 2:
        return f"{names[0]} is the only drive of its city (two are needed)"
    for name, run in zip(names, drives, strict=True):
        if len(run.X_WS) < _ASKED:
            return f"{name} has {len(run.X_WS)} clouds ({_ASKED} are needed)"
    for (name, run), (other, further) in itertools.combinations(
        zip(names, drives, strict=True), 2
    ):
        distances, _ = cKDTree(run.positions).query(further.positions)
        if distances.min() > _MATCH_RADIUS:
            return f"{name} and {other} are never within {_MATCH_RADIUS:g} m"
    return None


def training_tuples(runs: Sequence[ExportedDrive]) -> dict[int, Any]:
    """Returns the training data of PointNetVLAD: a tuple for each cloud number.

    A `TrainingTuple` contains the cloud's file and position, and two lists of
    cloud numbers: the clouds that are near enough to be positives, and all
    clouds that are too near to be negatives.

    Args:
        runs: drives whose clouds are numbered one after the other.
    """
    files = [file for run in runs for file in run.files]
    positions = np.concatenate([run.positions for run in runs])
    tree = cKDTree(positions)
    near = tree.query_ball_point(positions, _POSITIVE_RADIUS)
    wide = tree.query_ball_point(positions, _NON_NEGATIVE_RADIUS)
    kind = _tuple_class()
    found = {number: kind() for number in range(len(files))}
    for number, one in found.items():
        one.__dict__.update(
            id=number,
            timestamp=number,
            rel_scan_filepath=files[number],
            positives=np.array(sorted({*near[number]} - {number}), int),
            non_negatives=np.array(sorted(wide[number]), int),
            position=positions[number],
        )
    return found


def evaluation_sets(
    runs: Sequence[ExportedDrive],
) -> tuple[list[dict], list[dict]]:
    """Returns the evaluation data of PointNetVLAD: databases and queries.

    Args:
        runs: drives; each is a database and a set of queries.

    Returns:
        The list of databases, and the list of queries. Both lists contain a
        dictionary for each drive: number of a cloud -> file, northing and
        easting of the cloud. In the second list, the entry of a cloud also
        contains, for each other drive, the numbers of the clouds that match
        this cloud.
    """
    trees = [cKDTree(run.positions) for run in runs]

    def entries(run: ExportedDrive) -> dict[int, dict]:
        return {
            number: {"query": file, "northing": north, "easting": east}
            for number, (file, (north, east)) in enumerate(
                zip(run.files, run.positions.tolist(), strict=True)
            )
        }

    queries: list[dict[int, dict]] = [entries(run) for run in runs]
    for (i, tree), (j, run) in itertools.product(
        enumerate(trees), enumerate(runs)
    ):
        if i != j:
            near = tree.query_ball_point(run.positions, _MATCH_RADIUS)
            for number, matches in enumerate(near):
                queries[j][number][i] = sorted(matches)
    return [entries(run) for run in runs], queries


def _tuple_class() -> type:
    """Returns the class that training programs unpickle, named as there."""
    if _MODULE in sys.modules:
        return sys.modules[_MODULE].TrainingTuple
    module: Any = types.ModuleType(_MODULE)
    module.TrainingTuple = type("TrainingTuple", (), {"__module__": _MODULE})
    sys.modules.setdefault("datasets", types.ModuleType("datasets"))
    sys.modules[_MODULE] = module
    return module.TrainingTuple
