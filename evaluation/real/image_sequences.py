"""Sequences of bird's-eye images with poses, as BEVPlace's data of 2023.

A sequence is a folder with images `imgs/*.png` and a table `pose.txt`. Each
image becomes a cloud (see `evaluation.clouds.count_images`), so that methods
read the sequence like any other drive. The table has the upper 3 x 4 part of
the LiDAR's pose in each row. Only the position on the ground and the heading
count, because nothing else shows in an image from above.
"""

from collections.abc import Iterator
from dataclasses import dataclass
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from cns_drake.base.errors import InputError
from cns_drake.base.jobs.file_digests import file_digests
from cns_drake.base.listing import listed
from cns_drake.base.points import from_xyz
from cns_drake.base.progress import track
from evaluation.clouds.cloud_files import OnNote
from evaluation.clouds.count_images import (
    check_image,
    image_points,
    read_image,
)
from evaluation.drives.scan_files import FileDrive
from evaluation.drives.text_tables import read_poses
from evaluation.methods.method import yaw_pose
from evaluation.recognition.description import Role
from evaluation.study.tasks.task import NamedDrive

# Name of the folder with a folder for each sequence.
FOLDER = "kitti_bev"
# The LiDAR of KITTI; simulated scans of this one are judged beside the images.
UNIT = "hdl-64e"
_TABLE = "pose.txt"
# Greatest distance between a query and its match [m].
RADIUS = 5.0
# Sequence of KITTI odometry -> frames of the places and of the queries (first,
# end), by which BEVPlace was evaluated (ICCV 2023).
_SPLITS = {
    "00": ((0, 3000), (3200, 4541)),
    "02": ((0, 3400), (3600, 4661)),
    "05": ((0, 1000), (1200, 2751)),
    "06": ((0, 600), (800, 1101)),
}
_PERIOD_NS = 100_000_000


@dataclass(frozen=True)
class ImageSource:
    """A function that opens some images of a sequence as a drive.

    Attributes:
        folder: folder of the sequence.
        name: name of the drive.
        frames: numbers of the images, in the order of their names.
    """

    folder: Path
    name: str
    frames: tuple[int, ...]

    def __call__(self) -> FileDrive:
        files, X_WS = _read(self.folder)
        chosen = list(self.frames)
        return FileDrive(
            name=self.name,
            world_frame=self.folder.name,
            files=[files[k] for k in chosen],
            stamps_ns=_PERIOD_NS * np.array(chosen, np.int64),
            X_WS=X_WS[chosen],
            read=_read_cloud,
            tables=[self.folder / _TABLE],
        )

    def identity(self) -> list[list]:
        """Returns what identifies the images: their names and contents."""
        files = self().files
        names = [file.name for file in files]
        return [
            [self.name, list(self.frames)],
            *map(list, zip(names, file_digests(files), strict=True)),
        ]


class ImageSequence(NamedTuple):
    """A sequence whose images are places and queries.

    Attributes:
        name: name of the sequence in tables, such as `kitti_05`.
        places: the images that are places.
        queries: the images that are queries; each has a match.
    """

    name: str
    places: NamedDrive
    queries: NamedDrive


def open_sequences(folder: Path, on_note: OnNote) -> list[ImageSequence]:
    """Returns the sequences of images in a folder.

    The frames of places and queries are those by which BEVPlace was evaluated.
    Of another sequence, the first half are places, and the second half queries.
    As in that evaluation, only queries with a match count; the others are left
    out.

    Args:
        folder: folder with a folder for each sequence; it need not exist.
        on_note: is called with notes on what is left out.

    Raises:
        InputError: there is a folder but no sequence in it, or a sequence has
            no images, other images than square ones of 8 bits, no poses, or
            another number of them.
    """
    if not folder.exists():
        return []
    inside = [one for one in listed(folder) if one.is_dir()]
    if not inside:
        raise InputError(f"{folder}: no folder of a sequence in it")
    return [found for one in inside for found in _opened(one, on_note)]


def _opened(folder: Path, on_note: OnNote) -> Iterator[ImageSequence]:
    """Yields the sequence in a folder, unless no query has a match."""
    files, X_WS = _read(folder)
    for file in track(files, f"checking {folder}", len(files), "images"):
        check_image(file)
    name = f"kitti_{folder.name}"
    number = len(files)
    places, queries = _SPLITS.get(folder.name, ((0, 0), (0, number + 1)))
    if queries[1] > number:
        places, queries = (0, number // 2), (number // 2, number)
        on_note(
            f"{name}: no frames of the published evaluation: the first"
            f" {number // 2} of {number} images are places, the others queries"
        )
    p_WSs = X_WS[:, :2, 3]
    distance = np.full(number, math.inf)
    if places[1]:
        tree = cKDTree(p_WSs[slice(*places)])
        distance[slice(*queries)] = tree.query(p_WSs[slice(*queries)])[0]
    matched = np.flatnonzero(distance <= RADIUS)
    on_note(
        f"{name}: {len(matched)} of {queries[1] - queries[0]} queries have a"
        f" place within {RADIUS:g} m; the others are left out"
    )
    if len(matched):
        frames: dict[Role, tuple[int, ...]] = {
            "places": tuple(range(*places)),
            "queries": tuple(matched.tolist()),
        }
        drives = (
            NamedDrive(one := f"{name}_{role}", ImageSource(folder, one, shown))
            for role, shown in frames.items()
        )
        yield ImageSequence(name, *drives)


def _read(folder: Path) -> tuple[list[Path], np.ndarray]:
    """Returns the N images of a sequence, and their poses (N, 4, 4)."""
    images = folder / "imgs"
    files = listed(images, "*.png")
    if not files:
        raise InputError(f"{images}: no image (*.png) in it")
    X_WS = read_poses(folder / _TABLE)
    if len(X_WS) != len(files):
        raise InputError(
            f"{folder / _TABLE}: {len(X_WS)} rows for {len(files)} images"
        )
    headings = np.arctan2(X_WS[:, 1, 0], X_WS[:, 0, 0])
    flat = [
        yaw_pose(yaw, x, y)
        for yaw, (x, y) in zip(headings, X_WS[:, :2, 3], strict=True)
    ]
    return files, np.stack(flat)


def _read_cloud(path: Path, stamp_ns: int) -> np.ndarray:
    del stamp_ns  # An image has no times.
    return from_xyz(image_points(read_image(path)).astype(np.float32))
