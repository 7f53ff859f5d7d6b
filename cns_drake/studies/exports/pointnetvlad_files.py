"""Writes exported drives as the pickles that PointNetVLAD's trainers read."""

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

from cns_drake.base import completing

# Added to the northing of each further city [m].
CITY_DISTANCE = 100_000.0
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
        return north_east + np.array([CITY_DISTANCE * self.city, 0.0])

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
