"""How the cost of a search grows with the number of places.

    python tests/benchmarks/many_places.py [--methods NAME ...]
        [--places N ...] [--queries N] [--all-queries] [--features FOLDER]

Each place is another scene: a ground with walls and posts, drawn at random.
Scenes have few points, so that many can be described; a search does not depend
on the number of points. A query is a scene seen from elsewhere. With
`--features`, the places are those of the recordings of a study instead, of all
its drives together, and the queries are those of its last drive: FOLDER is
`report/parts/features` of `cns-drake reproduce`, before the study is finished
and removes its descriptors. Each method
and number of places has a process of its own, which keeps its descriptors in a
file as a study does. The CPU time of the description, of reading the places and
building the database, of a query without and with geometric verification, and
the peak of memory are printed. Places are read once for each batch of queries;
the time of a query does not include it, the last column does: it is the time
for as many queries as places, on one core. With `--all-queries`, there are as
many queries as places. Exponents are slopes of straight lines through
logarithms.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
import tempfile
import time

import numpy as np
from processes import in_process

from evaluation.base import LongList, Part
from evaluation.methods import Method, make_method
from evaluation.recognition import (
    MOST_BYTES,
    RANDOM_YAW_PROTOCOL,
    DescribedScans,
    DriveDescriptors,
    Search,
    StoredDrives,
    compare_at_radii,
    query_batches,
)

METHODS = ("scan-context++", "solid", "ring++", "btc", "layered-overlap")
PLACES = (300, 3000)
QUERIES = 20
# Distance between two places [m].
APART = 10.0
# Rows of no place.
_NO_ROWS = np.arange(0)


def scene(seed: int) -> np.ndarray:
    """Returns a scene as a LiDAR at a height of 1.6 m sees it, (N, 3)."""
    rng = np.random.default_rng([seed, 4])
    ground = rng.uniform(-30.0, 30.0, (8000, 3))
    ground[:, 2] = rng.normal(-1.6, 0.01, len(ground))
    parts = [ground]
    for _ in range(40):
        size = rng.choice([0.1, 5.0])
        along = rng.uniform(-size, size, 100)
        angle = rng.uniform(0.0, np.pi)
        x, y = rng.uniform(-30.0, 30.0, 2)
        wall = np.empty((100, 3))
        wall[:, 0] = x + along * np.cos(angle)
        wall[:, 1] = y + along * np.sin(angle)
        wall[:, 2] = rng.uniform(-1.6, rng.uniform(2.0, 8.0), 100)
        parts.append(wall)
    return np.concatenate(parts)


def seen_again(points: np.ndarray, seed: int) -> np.ndarray:
    """Returns a scene from up to 3 m away, at another heading."""
    rng = np.random.default_rng([seed, 5])
    angle = rng.uniform(0.0, 2.0 * np.pi)
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    shifted = points - [*rng.uniform(-2.0, 2.0, 2), 0.0]
    return shifted @ R + rng.normal(0.0, 0.01, points.shape)


def described(frames: np.ndarray, descriptors: Sequence) -> DescribedScans:
    """Returns places or queries, each at a distance from all others."""
    X_WS = np.tile(np.eye(4), (len(frames), 1, 1))
    X_WS[:, 0, 3] = APART * frames
    return DescribedScans(frames, frames, X_WS, descriptors)


def drawn(
    method: Method, num_places: int, num_queries: int, folder: Path
) -> tuple[DescribedScans, DescribedScans]:
    """Returns places and queries of scenes that are drawn at random."""
    of_places = LongList(folder)
    for k in range(num_places):
        of_places.append(method.describe_place(scene(k)))
    chosen = np.linspace(0, num_places - 1, num_queries).astype(int)
    of_queries = LongList(folder)
    for k in chosen.tolist():
        of_queries.append(method.describe(seen_again(scene(k), k)))
    places = described(np.arange(num_places), of_places)
    return places, described(chosen, of_queries)


def in_file(places: DescribedScans, file: Path) -> DescribedScans:
    """Returns places whose descriptors are read from a file, as in a study."""
    part = Part(file)
    part.write({}, DriveDescriptors("places", places, places.chosen(_NO_ROWS)))
    store = StoredDrives([part.read], [part.size()], MOST_BYTES)
    rows = np.arange(len(places.frames))
    return store.described(store.undescribed(0), np.zeros_like(rows), rows)


def recorded(
    name: str, num_places: int, num_queries: int, features: Path
) -> tuple[DescribedScans, DescribedScans]:
    """Returns places and queries of the recordings of a study."""
    files = sorted(features.glob(f"*/described_{name}.data"))
    drives = []
    for file in files:
        drives.append(Part(file).read())
    of_places = [one for d in drives for one in d.places.descriptors]
    asked = drives[-1].queries.descriptors
    if num_places > len(of_places):
        raise SystemExit(f"{features}: only {len(of_places)} places")
    # Of all drives, if not all places are used.
    used = np.linspace(0, len(of_places) - 1, num_places).astype(int)
    chosen = np.linspace(0, len(asked) - 1, num_queries).astype(int)
    return (
        described(np.arange(num_places), [of_places[k] for k in used]),
        described(chosen, [asked[k] for k in chosen]),
    )


def measure(
    name: str,
    num_places: int,
    num_queries: int,
    features: Path | None,
    file: Path,
) -> None:
    """Writes what a method's search takes to a file, see `report`."""
    method = make_method(name, {})
    # The first call of a function loads and compiles.
    method.describe(scene(0))
    start = time.process_time()
    folder = file.parent
    if features is None:
        places, asked = drawn(method, num_places, num_queries, folder)
    else:
        places, asked = recorded(name, num_places, num_queries, features)
    describing = (time.process_time() - start) / num_places
    places = in_file(places, folder / "places.data")
    none = described(_NO_ROWS, [])
    database = DriveDescriptors("places", places, none)
    loading = _timed_loading()
    times, right = [], 0
    for radii in ([None], [None, 7.5]):
        # The first query does not count: it compiles.
        for part in (slice(0, 1), slice(0, None)):
            rows = np.arange(len(asked.frames))[part]
            query = DriveDescriptors("queries", none, asked.chosen(rows))
            loading.clear()
            start = time.process_time()
            for _, (found, *_) in compare_at_radii(
                Search(method, places),
                database,
                query,
                RANDOM_YAW_PROTOCOL,
                radii,
            ):
                right += int((found.best_places == found.query_frames).sum())
        spent = time.process_time() - start - sum(loading)
        times.append(spent / num_queries)
    batches = len(list(query_batches(num_queries, num_places)))
    once = sum(loading) / batches
    np.savetxt(file, [describing, once, *times, right, _peak()])


def _timed_loading() -> list[float]:
    """Returns a list that gets the CPU time of each loading of places [s].

    The places are read, and a database is built of them.
    """
    spent: list[float] = []
    build = Search._build

    def timed(search: Search, number: int) -> None:
        start = time.process_time()
        build(search, number)
        spent.append(time.process_time() - start)

    Search._build = timed
    return spent


def _peak() -> float:
    """Returns the greatest resident memory of this process so far [MB]."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM"):
            return int(line.split()[1]) / 1e3
    return np.nan


def report(
    name: str,
    numbers: list[int],
    num_queries: int | None,
    features: Path | None,
) -> None:
    """Prints a line for each number of places, and the exponent."""
    spent = []
    for number in numbers:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "times"
            asked = number if num_queries is None else min(num_queries, number)
            in_process(measure, name, number, asked, features, file)
            describing, loading, alone, verified, _, peak = np.loadtxt(file)
        spent.append(verified)
        batches = len(list(query_batches(number, number)))
        whole = number * verified + batches * loading
        print(
            f"{name:16} {number:6} places: describe {1e3 * describing:.1f} ms,"
            f" load {loading:.3f} s, query {1e3 * alone:.2f} ms,"
            f" verified {1e3 * verified:.2f} ms, peak {peak:.0f} MB;"
            f" {number} queries {whole / 3600.0:.2g} h",
            flush=True,
        )
    if len(numbers) > 1:
        slope, _ = np.polyfit(np.log(numbers), np.log(spent), 1)
        print(f"{name:16} time of a query ~ places^{slope:.2f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--methods", nargs="+", default=METHODS)
    parser.add_argument("--places", nargs="+", type=int, default=PLACES)
    parser.add_argument("--queries", type=int, default=QUERIES)
    parser.add_argument("--all-queries", action="store_true")
    parser.add_argument("--features", type=Path)
    arguments = parser.parse_args()
    queries = None if arguments.all_queries else arguments.queries
    for name in arguments.methods:
        report(name, arguments.places, queries, arguments.features)


if __name__ == "__main__":
    main()
