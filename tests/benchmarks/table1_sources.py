"""What raises TCR_sym without a change of the city, on drives of your own.

    python tests/benchmarks/table1_sources.py A B [A_UNCHANGED B ...]

For each pair of drives, a row for each choice that the paper leaves open (grid,
spacing of scans, voxel centres) and for frames that differ by a yaw, and the
least and greatest share of B's picture that is new since A, by several
distances and from four sides, as red in the paper's Figure 1.
`docs/notes/cities.md` shows the result for Metropolis.
"""

import argparse
import csv
from operator import attrgetter
from pathlib import Path
import sys

import numpy as np

from evaluation import map_drive, open_drive
from evaluation.base import poses
from evaluation.change import lacks_counterpart, temporal_change
from evaluation.drives import sample_frames
from evaluation.maps import CELL_SIZE, VOXEL_SIZE, VoxelMap
from evaluation.results import OrthographicView, render

# Distances between the scans of a map [m]; 0 takes all of them.
SPACINGS = (0.0, 10.0, 50.0)
YAWS_DEG = (0.5, 1.0, 1.5, 2.0)
# What is red: distances from the older map, and directions of the view.
RED_DISTANCES = (1.0, 2.0, 4.5)
AZIMUTHS_DEG = (-55.0, 35.0, 125.0, 215.0)
RED_SPACING, RED_VOXEL = 2.5, 0.5


def read(path: Path) -> dict[float, VoxelMap]:
    """Returns spacing of the scans [m] -> map of a drive."""
    drive = open_drive(path)
    p_WS = drive.X_WS[:, :3, 3]
    return {
        spacing: map_drive(
            drive, voxel_size, sample_frames(p_WS, spacing) if spacing else None
        )
        for spacing, voxel_size in (
            *((one, CELL_SIZE) for one in SPACINGS),
            (RED_SPACING, RED_VOXEL),
        )
    }


def red_shares(a: np.ndarray, b: np.ndarray):
    """Yields shares of pictures of a map B that map A does not have."""
    for tau in RED_DISTANCES:
        red = lacks_counterpart(b, a, tau)
        rgb = np.where(red[:, None], (255, 0, 0), (0, 0, 255)).astype(np.uint8)
        for azimuth_deg in AZIMUTHS_DEG:
            view = OrthographicView(azimuth_deg, 38.0, 2.0)
            image = render(b, rgb, view, size_px=2).image
            # Only paper is green.
            shown = image[image[..., 1] == 0]
            yield float((shown[:, 0] > shown[:, 2]).mean())


def centres(voxels: VoxelMap) -> np.ndarray:
    """Returns the middle of each voxel (V, 3) [m]."""
    return voxels.origin_W + (voxels.indices + 0.5) * voxels.voxel_size


def rows(a: dict[float, VoxelMap], b: dict[float, VoxelMap]):
    """Yields (choice, TCR_sym or share) of two maps."""
    fine_a, fine_b = a[0.0], b[0.0]
    about = fine_a.centroids_W.mean(axis=0)

    def tcr(X=None, *, shift=(0.0, 0.0, 0.0), of=attrgetter("centroids_W")):
        clouds = (
            of(fine_a.merged(shift=shift)),
            of(fine_b.merged(shift=shift, X_NW=X)),
        )
        return temporal_change(*clouds).symmetric

    yield "as defined", tcr()
    half = (VOXEL_SIZE / 2,) * 3
    yield "grid shifted by half a voxel", tcr(shift=half)
    for spacing in SPACINGS[1:]:
        clouds = [one[spacing].merged().centroids_W for one in (a, b)]
        yield (
            f"a scan every {spacing:g} m",
            temporal_change(*clouds).symmetric,
        )
    yield "voxel centres", tcr(of=centres)
    for yaw_deg in YAWS_DEG:
        X = poses.yaw_pose(np.radians(yaw_deg))
        X[:3, 3] = about - poses.transform(X, about)
        yield f"yaw of {yaw_deg:g} deg", tcr(X)
        yield f"yaw of {yaw_deg:g} deg, voxel centres", tcr(X, of=centres)
    clouds = [one[RED_SPACING].centroids_W for one in (a, b)]
    shares = list(red_shares(*clouds))
    yield "least red share", min(shares)
    yield "greatest red share", max(shares)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drives", nargs="+", type=Path)
    drives = parser.parse_args().drives
    if len(drives) % 2:
        parser.error("drives come in pairs")
    maps = {path: read(path) for path in dict.fromkeys(drives)}
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["database", "query", "choice", "value"])
    for a, b in zip(drives[::2], drives[1::2], strict=True):
        for choice, value in rows(maps[a], maps[b]):
            table.writerow([a.name, b.name, choice, f"{value:.4f}"])


if __name__ == "__main__":
    main()
