"""Time and peak memory of `cns-eval tcr` on two large map files.

    python tests/benchmarks/tcr_of_large_maps.py [--points N] [--format EXT]

Aim: 10 million points a map in under 10 s and 2 GB.
"""

import argparse
from pathlib import Path
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np


def make_city(number: int, seed: int) -> np.ndarray:
    """Returns points (N, 3) float32 on the ground and walls of a city."""
    rng = np.random.default_rng([seed, number])
    points = rng.uniform([-250, -250, 0], [250, 250, 0], (number, 3))
    corners = np.random.default_rng(1).uniform(-240, 240, (300, 2))
    on_walls = np.arange(number) % 2 == 0
    block = rng.integers(len(corners), size=number // 2 + number % 2)
    points[on_walls, :2] = corners[block]
    points[on_walls] += rng.uniform(size=(len(block), 3)) * [9.0, 0.2, 50.0]
    if seed:
        points[on_walls & (rng.uniform(size=number) < 0.2), 0] += 20.0
    return points.astype(np.float32)


def write(path: Path, points: np.ndarray) -> None:
    if path.suffix == ".npy":
        np.save(path, points)
    elif path.suffix == ".bin":
        np.c_[points, np.zeros(len(points), dtype=np.float32)].tofile(path)
    else:
        header = (
            "ply\nformat binary_little_endian 1.0\n"
            f"element vertex {len(points)}\nproperty float x\n"
            "property float y\nproperty float z\nend_header\n"
        )
        path.write_bytes(header.encode() + points.tobytes())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=10_000_000)
    parser.add_argument(
        "--format", choices=["npy", "bin", "ply"], default="npy"
    )
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{s}.{arguments.format}" for s in (0, 1)]
        for seed, path in enumerate(paths):
            write(path, make_city(arguments.points, seed))
        start = time.perf_counter()
        subprocess.run(
            [sys.executable, "-m", "evaluation", "tcr", *map(str, paths)],
            check=True,
        )
        seconds = time.perf_counter() - start
    # Memory of the largest child, in KiB on Linux.
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(
        f"2 x {arguments.points} points: {seconds:.1f} s, peak {peak:.0f} MiB"
    )


if __name__ == "__main__":
    main()
