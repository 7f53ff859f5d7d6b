"""Scans of all drives through a sampled city, and their exact overlaps."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import shutil

import numpy as np

from cns_drake.base import InputError, Reporter, poses, track
from cns_drake.simulation import SimulatedDrive
from cns_drake.studies.ground_truth.exact_overlap import (
    VisibleSurfaces,
    sights_of,
)
from cns_drake.studies.training.sampled_city import SampledCity
from evaluation.drives import cloud_at, sample_frames
from evaluation.methods import polar_image

# Distance between two scans [m].
_SCAN_SPACING = 6.0
# As in the protocol of the paper [m].
_MAX_RANGE = 100.0
# Scans farther apart count as having no overlap [m].
_FARTHEST_OVERLAP = 50.0
# The overlap is estimated from about this number of points of a scan.
_OVERLAP_POINTS = 1000


def scan_city(
    reporter: Reporter, drawn: SampledCity, folder: Path
) -> dict[str, np.ndarray]:
    """Simulates the drives through a city, without recording them.

    Args:
        reporter: reports progress.
        drawn: the random city.
        folder: folder to which the map of the city is written; the folder is
            removed at the end.

    Returns:
        `images` (N, RINGS, SECTORS, CHANNELS) uint8 polar images of the scans,
        `xy` (N, 2) positions of the sensors [m] and `drives` (N,) number of
        each scan's drive. If the field `graded` of the city is true, also
        `overlaps` (N, N) float16, the share of each scan that is visible from
        the place of each other scan.
    """
    images, xy, numbers = [], [], []
    taken: list[_TakenScan] = []
    try:
        drawn.write(folder)
        for number, scenario in enumerate(drawn.drives(folder)):
            try:
                drive = SimulatedDrive(scenario)
            except InputError as error:
                # A draw may be impossible, such as a U-turn in a narrow road.
                reporter.note(f"{scenario.name} left out: {error}")
                continue
            frames = sample_frames(drive.X_WS[:, :3, 3], _SCAN_SPACING)
            height = next(iter(scenario.lidars.values())).xyz[2]
            for frame in track(
                frames, f"simulating {scenario.name}", len(frames), "scans"
            ):
                points = cloud_at(drive, int(frame), 1, _MAX_RANGE)
                images.append(polar_image(points, height))
                xy.append(drive.X_WS[frame, :2, 3])
                numbers.append(number)
                taken.append(
                    _TakenScan(drive, int(frame), _overlap_sample(points))
                )
        found = {"overlaps": _overlaps(taken, reporter)} if drawn.graded else {}
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return {
        "images": np.stack(images),
        "xy": np.stack(xy),
        "drives": np.array(numbers),
        **found,
    }


@dataclass(frozen=True)
class _TakenScan:
    """A scan of a drive, with some of its points in the LiDAR's frame."""

    drive: SimulatedDrive
    frame: int
    points: np.ndarray


def _overlap_sample(points: np.ndarray) -> np.ndarray:
    return points[:: max(1, len(points) // _OVERLAP_POINTS)].astype(float)


def _overlaps(scans: Sequence[_TakenScan], reporter: Reporter) -> np.ndarray:
    """Returns which share of each scan is visible from every other scan.

    The share is exact (see `exact_overlap`). It is 0 for two scans of one drive
    and for scans over 50 m apart.

    Returns:
        (N, N) float16: a row for each scan, a column for each place.
    """
    result = np.zeros((len(scans), len(scans)), np.float16)
    X_WSs = np.stack([one.drive.X_WS[one.frame] for one in scans])
    places = track(enumerate(scans), "comparing scans", len(scans), "scans")
    for column, place in places:
        seen = VisibleSurfaces(sights_of(place.drive)(place.frame), _MAX_RANGE)
        X_PW = poses.inverse(X_WSs[column])
        apart = np.linalg.norm(X_WSs[:, :2, 3] - X_WSs[column, :2, 3], axis=1)
        for row in np.flatnonzero(apart <= _FARTHEST_OVERLAP).tolist():
            if scans[row].drive is not place.drive:
                X_PS = X_PW @ X_WSs[row]
                p_P = scans[row].points @ X_PS[:3, :3].T + X_PS[:3, 3]
                result[row, column] = seen.share_of(p_P)
    return result
