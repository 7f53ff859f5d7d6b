"""Where the time goes when recordings are mapped and places recognised.

    python tests/benchmarks/evaluation_of_recordings.py DATABASE QUERY

Aim: under 45 s for the map of 6000 scans of 25000 points on one core, and
under 30 s for the place recognition of one pair.
"""

import argparse
from collections.abc import Callable
from pathlib import Path
import resource
import time

from evaluation.drives import cloud_at, open_drive
from evaluation.maps import MappedDrive, map_drive
from evaluation.methods import make_method
from evaluation.recognition import retrieve


def measure(label: str, work: Callable, number: int = 1):
    start = time.perf_counter()
    result = work()
    seconds = time.perf_counter() - start
    each = f", {1e3 * seconds / number:.2f} ms each" if number > 1 else ""
    print(f"{label:<32} {seconds:7.2f} s{each}")
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("database", type=Path)
    parser.add_argument("query", type=Path)
    arguments = parser.parse_args()
    drive = measure("open", lambda: open_drive(arguments.query))
    number = len(drive)
    measure("stamps and poses", lambda: drive.X_WS, number)
    sizes = measure(
        "read scans",
        lambda: [len(drive.scan(i)) for i in range(number)],
        number,
    )
    print(f"{number} scans of {sum(sizes) / number:.0f} points")
    # Compiles, unless an earlier run has left the code on disk.
    measure("map, first call", lambda: map_drive(drive), number)
    voxels = measure("map", lambda: map_drive(drive), number)
    print(f"{len(voxels)} voxels of {voxels.voxel_size} m")
    _, fine = measure(
        "map and cloud for pictures",
        lambda: MappedDrive(drive, kept=1).finish(),
        number,
    )
    print(f"{len(fine)} points for pictures")
    method = make_method("scan-context++", {})
    clouds = [cloud_at(drive, i, 1, 100.0) for i in range(0, number, 20)]
    places = measure(
        "describe places",
        lambda: [method.describe_place(cloud) for cloud in clouds],
        len(clouds),
    )
    queries = measure(
        "describe queries",
        lambda: [method.describe(cloud) for cloud in clouds],
        len(clouds),
    )
    database = measure("build database", lambda: method.build_database(places))
    measure(
        f"score {len(queries)} x {len(places)}, candidates",
        lambda: [method.score(query, database) for query in queries],
        len(queries),
    )
    measure(
        f"score {len(queries)} x {len(places)}, all",
        lambda: [
            method.score(query, database, exhaustive=True) for query in queries
        ],
        len(queries),
    )
    measure(
        "place recognition of the pair",
        lambda: retrieve(
            open_drive(arguments.database),
            open_drive(arguments.query),
            method,
        ),
    )
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory {peak:.0f} MiB")


if __name__ == "__main__":
    main()
