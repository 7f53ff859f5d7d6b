"""What raises TCR_sym without a change of the city, on drives of your own.

    python tests/benchmarks/table1_sources.py A B [A_UNCHANGED B ...]

For each pair of drives, a row for each choice that the paper leaves open (hull,
grid, spacing of scans, voxel centres) and for each small difference between the
frames of the two drives (yaw, offset). `docs/notes/cities.md` shows the
result for Metropolis.
"""

import argparse
import csv
from pathlib import Path
import sys

import numpy as np

from evaluation import map_drive, open_drive
from evaluation.change import temporal_change
from evaluation.drives import sample_frames
from evaluation.maps import CELL_SIZE, VOXEL_SIZE, VoxelMap

# Distances between the scans of a map [m]; 0 takes all of them.
SPACINGS = (0.0, 10.0, 50.0)
YAWS_DEG = (0.5, 1.0, 1.5, 2.0)
OFFSETS = {
    "0.5 m in z": (0.0, 0.0, 0.5),
    "1 m in x and y": (1.0, 1.0, 0.0),
}


def read(path: Path) -> dict[float, VoxelMap]:
    """Returns spacing of the scans [m] -> map of a drive, in voxels of 1 m."""
    drive = open_drive(path)
    p_WS = drive.X_WS[:, :3, 3]
    return {
        spacing: map_drive(
            drive, CELL_SIZE, sample_frames(p_WS, spacing) if spacing else None
        )
        for spacing in SPACINGS
    }


def moved(yaw_deg: float = 0.0, xyz=(0.0, 0.0, 0.0), about=(0.0, 0.0, 0.0)):
    """Returns the (4, 4) pose of the world in a frame that differs from it."""
    c, s = np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))
    X = np.eye(4)
    X[:2, :2] = [[c, -s], [s, c]]
    X[:3, 3] = np.add(xyz, about) - X[:3, :3] @ np.asarray(about)
    return X


def rows(a: dict[float, VoxelMap], b: dict[float, VoxelMap]):
    """Yields (choice, TCR_sym) of two maps."""
    fine_a, fine_b = a[0.0], b[0.0]
    about = fine_a.centroids_W.mean(axis=0)

    def tcr(X=None, *, shift=(0.0, 0.0, 0.0), of="centroids_W", margin=None):
        clouds = (
            getattr(fine_a.merged(shift=shift), of),
            getattr(fine_b.merged(shift=shift, X_NW=X), of),
        )
        choices = {} if margin is None else {"margin": margin}
        return temporal_change(*clouds, **choices).symmetric

    yield "as defined", tcr()
    yield "hull without a margin", tcr(margin=0.0)
    yield "hull with a margin of 5 m", tcr(margin=5.0)
    half = (VOXEL_SIZE / 2,) * 3
    yield "grid shifted by half a voxel", tcr(shift=half)
    for spacing in SPACINGS[1:]:
        clouds = [one[spacing].merged().centroids_W for one in (a, b)]
        yield (
            f"a scan every {spacing:g} m",
            temporal_change(*clouds).symmetric,
        )
    yield "voxel centres", tcr(of="centres_W")
    for yaw_deg in YAWS_DEG:
        X = moved(yaw_deg, about=about)
        yield f"yaw of {yaw_deg:g} deg", tcr(X)
        yield f"yaw of {yaw_deg:g} deg, voxel centres", tcr(X, of="centres_W")
    for name, xyz in OFFSETS.items():
        yield name, tcr(moved(xyz=xyz))
        yield f"{name}, voxel centres", tcr(moved(xyz=xyz), of="centres_W")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drives", nargs="+", type=Path)
    drives = parser.parse_args().drives
    if len(drives) % 2:
        parser.error("drives come in pairs")
    maps = {path: read(path) for path in dict.fromkeys(drives)}
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["database", "query", "choice", "tcr_sym"])
    for a, b in zip(drives[::2], drives[1::2], strict=True):
        for choice, value in rows(maps[a], maps[b]):
            table.writerow([a.name, b.name, choice, f"{value:.4f}"])


if __name__ == "__main__":
    main()
