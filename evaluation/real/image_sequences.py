"""Sequences of bird's-eye images with poses, like BEVPlace's data of 2023.

A sequence is a folder with images `imgs/*.png` and a table `pose.txt`, or with
two such folders, `places` and `queries`. Each image becomes a cloud (see
`evaluation.clouds.count_images`), so that methods read the sequence like any
other drive. The table has the upper 3 x 4 part of the LiDAR's pose in each row.
Only the position on the ground and the heading count, because an image from
above shows nothing else. `write_images` makes such a folder of any drive.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, get_args

import numpy as np
from PIL import Image
from scipy.spatial import cKDTree

from cns_drake.base import (
    InputError,
    draft_folder,
    file_digests,
    from_xyz,
    listed,
    poses,
    track,
    user_errors,
    xyz,
)
from cns_drake.drives import Drive, deskewed_notes, deskewed_scan
from evaluation.clouds import (
    OnNote,
    check_image,
    count_image,
    image_points,
    read_image,
)
from evaluation.drives import FileDrive, read_poses
from evaluation.recognition import Role
from evaluation.study import NamedDrive

# Name of the folder with a folder for each sequence.
FOLDER = "kitti_bev"
# The LiDAR of KITTI; simulated scans of this one are judged beside the images.
UNIT = "hdl-64e"
_IMAGES = "imgs"
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
# Time between two images [ns].
_PERIOD_NS = 100_000_000
# Seed by which one place is drawn for each of a few queries.
_SEED = 90


@dataclass(frozen=True)
class ImageSource:
    """A function that opens some images of a sequence as a drive.

    Attributes:
        folder: folder of the images and their poses.
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
            world_frame=_sequence(self.folder).name,
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


def open_sequences(
    folder: Path, on_note: OnNote, queries: int | None = None
) -> list[ImageSequence]:
    """Returns the sequences of images in a folder.

    For the sequences on which BEVPlace was evaluated, the places and queries
    are the same frames as in the evaluation of BEVPlace. In any other sequence,
    the first half of the images are places and the second half are queries,
    unless the sequence has one folder for places and one for queries. Queries
    without a match are left out, as in that evaluation.

    Args:
        folder: folder of the sequences, which need not exist. Each sequence is
            a folder in it.
        on_note: is called with notes on what is left out.
        queries: number of queries of a sequence, chosen evenly among the
            queries with a match. If a number is given, the places are only one
            random match of each query. By default, all queries and all places
            are used.

    Raises:
        InputError: there is a folder but no sequence in it, or a sequence has
            no images, an image that is not square or not of 8 bits, or not
            exactly one pose for each image.
    """
    return [
        found
        for sequence_folder in _folders(folder)
        for found in _opened(sequence_folder, on_note, queries)
    ]


def open_images(folder: Path) -> list[NamedDrive]:
    """Returns a drive for each sequence of images in a folder.

    The drive of a sequence with a folder `places` contains only the images in
    this folder.

    Args:
        folder: as for `open_sequences`.

    Raises:
        InputError: see `open_sequences`.
    """
    found = []
    for sequence_folder in _folders(folder):
        shown = _parts(sequence_folder)[0] or sequence_folder
        frames = tuple(range(len(_read(shown)[0])))
        source = ImageSource(shown, sequence_folder.name, frames)
        found.append(
            NamedDrive(sequence_folder.name, source, num_scans=len(frames))
        )
    return found


def write_images(drive: Drive, folder: Path, on_note: OnNote) -> None:
    """Writes an image of each scan of a drive, and a table of the poses.

    The motion of the LiDAR during a scan is taken out. The files appear under
    their final names only when all files are complete.

    Args:
        drive: the drive.
        folder: folder to write, which must be new or empty.
        on_note: is called with notes on how the drive is read.

    Raises:
        InputError: a scan cannot be read, or the folder cannot be written.
    """
    for note in deskewed_notes(drive):
        on_note(note)
    with draft_folder(folder) as draft, user_errors(folder):
        (draft / _IMAGES).mkdir(parents=True)
        number = len(drive)
        for frame in track(range(number), "making images", number, "images"):
            scan = deskewed_scan(drive, frame)
            image = Image.fromarray(count_image(xyz(scan)))
            image.save(draft / _IMAGES / f"{frame:06d}.png")
        rows = drive.X_WS[:, :3].reshape(-1, 12).tolist()
        (draft / _TABLE).write_text(
            "".join(f"{' '.join(map(repr, row))}\n" for row in rows)
        )


def _folders(folder: Path) -> list[Path]:
    """Returns the folders of the sequences in a folder that may not exist."""
    if not folder.exists():
        return []
    inside = [entry for entry in listed(folder) if entry.is_dir()]
    if not inside:
        raise InputError(f"{folder}: no folder of a sequence in it")
    return inside


def _parts(folder: Path) -> tuple[Path | None, Path | None]:
    """Returns the folders of places and queries in a sequence, if any."""
    places, queries = (folder / role for role in get_args(Role))
    if not (places.is_dir() or queries.is_dir()):
        return None, None
    return places, queries


def _sequence(images: Path) -> Path:
    """Returns the folder of the sequence to which images belong."""
    return images.parent if images.name in get_args(Role) else images


def _opened(
    folder: Path, on_note: OnNote, most: int | None
) -> Iterator[ImageSequence]:
    """Yields the sequence in a folder, unless no query has a match."""
    # The sequences of KITTI odometry are numbers.
    name = f"kitti_{folder.name}" if folder.name.isdigit() else folder.name
    folders = [part for part in _parts(folder) if part] or [folder]
    found = [_read(images) for images in folders]
    for images, (files, _) in zip(folders, found, strict=True):
        for file in track(files, f"checking {images}", len(files), "images"):
            check_image(file)
    splits = [range(len(files)) for files, _ in found]
    if len(splits) == 1:
        splits = _split(folder.name, name, len(splits[0]), on_note)
    p_WPs, p_WQs = (
        X_WS[split.start : split.stop, :2, 3]
        for (_, X_WS), split in zip((found[0], found[-1]), splits, strict=True)
    )
    matches: Sequence[list[int]] = [[] for _ in p_WQs]
    if len(p_WPs) and len(p_WQs):
        tree = cKDTree(p_WPs)
        matches = tree.query_ball_point(p_WQs, RADIUS, return_sorted=True)
    queries = [k for k, places in enumerate(matches) if places]
    on_note(
        f"{name}: {len(queries)} of {len(p_WQs)} queries have a place within"
        f" {RADIUS:g} m; the others are left out"
    )
    if not queries:
        return
    places = list(range(len(p_WPs)))
    if most is not None:
        ends = np.linspace(0, len(queries) - 1, min(most, len(queries)))
        queries = [queries[k] for k in ends.round().astype(int)]
        rng = np.random.default_rng(_SEED)
        places = sorted({int(rng.choice(matches[k])) for k in queries})
        on_note(
            f"{name}: {len(queries)} of these queries, and {len(places)} of"
            f" {len(p_WPs)} places"
        )
    chosen = zip(
        get_args(Role),
        (folders[0], folders[-1]),
        splits,
        (places, queries),
        strict=True,
    )
    drives = (
        NamedDrive(
            drive := f"{name}_{role}",
            ImageSource(shown, drive, tuple(split[k] for k in numbers)),
            num_scans=len(numbers),
        )
        for role, shown, split, numbers in chosen
    )
    yield ImageSequence(name, *drives)


def _split(folder: str, name: str, number: int, on_note: OnNote) -> list[range]:
    """Returns the frames of the places and of the queries in a sequence."""
    splits = [range(*ends) for ends in _SPLITS.get(folder, ())]
    if splits and splits[-1].stop <= number:
        return splits
    half = number // 2
    on_note(
        f"{name}: no frames of the published evaluation: the first {half} of"
        f" {number} images are places, the others queries"
    )
    return [range(half), range(half, number)]


def _read(folder: Path) -> tuple[list[Path], np.ndarray]:
    """Returns the N images of a sequence, and their poses (N, 4, 4)."""
    images = folder / _IMAGES
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
        poses.yaw_pose(yaw, x, y)
        for yaw, (x, y) in zip(headings, X_WS[:, :2, 3], strict=True)
    ]
    return files, np.stack(flat)


def _read_cloud(path: Path, stamp_ns: int) -> np.ndarray:
    del stamp_ns  # An image has no times.
    return from_xyz(image_points(read_image(path)).astype(np.float32))
