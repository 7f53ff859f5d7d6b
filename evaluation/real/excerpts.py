"""Public data sets of few scans: where each file is from, and how it is read.

The data sets are not shipped. Each is a folder with a given name in a common
folder, see `docs/real.md`. The digest of a data set's scans shows whether the
scans are the same as in earlier measurements.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
import hashlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cns_drake.base import InputError, file_digests, listed, read_bytes
from cns_drake.drives import Drive, lidar_field
from evaluation.clouds import OnNote, read_cloud
from evaluation.drives import (
    BinDrive,
    FileDrive,
    open_drive,
    read_helipr_scan,
    read_nclt_scan,
    read_poses,
    read_quaternions,
)
from evaluation.real.image_sequences import FOLDER as IMAGES
from evaluation.study import NamedDrive, RecordingSource

# Distance put between scans without poses [m]; no scan reaches so far.
_APART = 1000.0


class Excerpt(NamedTuple):
    """A public data set, or one LiDAR of a public data set.

    Attributes:
        folder: name of the data set's folder.
        scans: pattern of the files in this folder.
        world: name of the region where the scans were recorded; several data
            sets can share it.
        unit: name of the LiDAR's unit.
        height: height of the LiDAR above the ground [m].
        origin: repository of the data set, and path in this repository.
        licence: terms of use.
        digest: SHA-256 of all scans, concatenated in the order of their names.
        poses: where the poses are: `drive` for a folder that
            `evaluation.drives.open_drive` reads; `matrices` for a file
            `poses.txt` with the upper 3 x 4 part of X_WS in each row; `named`
            for a `poses.txt` with a scan's name, x y z and quat_xyzw in each
            row; "" for a data set without poses.
        read: function that reads a scan; None for files with an ending that
            `evaluation.clouds.cloud_files.read_cloud` knows.
        whole: whether the scans contain all points that the LiDAR measured.
        columns: number of columns of the data set's `.bin` files. If the files
            have another digest, the number is found from the values.
    """

    folder: str
    scans: str
    world: str
    unit: str
    height: float
    origin: str
    licence: str
    digest: str
    poses: str = ""
    read: Callable[[Path], np.ndarray] | None = None
    whole: bool = True
    columns: int | None = None


_NC = "CC BY-NC-SA 3.0"
EXCERPTS = (
    Excerpt(
        "kitti_00",
        "velodyne/*.bin",
        "kitti_00",
        "hdl-64e",
        1.73,
        "KITTI odometry, sequences/00/velodyne",
        _NC,
        "cbe2592584f33df2992d10ebf203b699dff3e19883c19646cc5825c6d0a9ebb6",
        "drive",
    ),
    Excerpt(
        "kitti_00_revisits",
        "*.npy",
        "kitti_00",
        "hdl-64e",
        1.73,
        "nubot-nudt/LCR-Net, demo/data_demo",
        _NC,
        "ec11803aa6886c2cdcfe415fca0aab549f837e681308f61639887ba3068eda75",
        "named",
        whole=False,
    ),
    Excerpt(
        "nuscenes_1072",
        "velodyne/*.bin",
        "nuscenes_1072",
        "hdl-32e",
        1.84,
        "nubot-nudt/SegNet4D, demo_data/nuScenes_kitti/val/1072",
        "nuScenes, non-commercial",
        "8a5a58f5e799eafab56ebf9a7d25c1aa23b1510a26e3a164dce0e8901b6df890",
        "matrices",
        columns=4,
    ),
    Excerpt(
        "newer_06",
        "deskewed_*.bin",
        "newer_06",
        "os1-64-33",
        1.0,
        "Newer College, 06",
        "CC BY-NC-SA 4.0",
        "2980972897a68256b3ecd15cd4d4ca1e2960bc932d648fbac88a047806d68fe1",
        "",
        columns=3,
    ),
    Excerpt(
        "nclt",
        "*.bin",
        "nclt",
        "hdl-32e-upside-down",
        0.96,
        "NCLT, 2012-01-15/velodyne_sync",
        "ODbL",
        "56c0aead58880ca33625aa75af52579f2c3bf6e5f2a2f8e698a6113f802351c8",
        "",
        read_nclt_scan,
    ),
    Excerpt(
        "helipr_two_lidars",
        "avia_*.bin",
        "helipr",
        "avia",
        1.7,
        "sparolab/SOLiD",
        "CC BY-NC-SA 4.0",
        "7fac1a8479ca7d07b10f30b7cb242fe1e473cbfed6ab5e0b2ffedfcdec0991d4",
        "",
        partial(read_helipr_scan, "Avia"),
    ),
    Excerpt(
        "helipr_two_lidars",
        "aeva_*.bin",
        "helipr",
        "aeva",
        1.7,
        "sparolab/SOLiD",
        "CC BY-NC-SA 4.0",
        "416e0a252c6827dec4d2e9331a28db0cc8efae8ca710dd022f71616bf82f1730",
        "",
        partial(read_helipr_scan, "Aeva"),
    ),
)


@dataclass(frozen=True)
class ExcerptSource:
    """A function that opens a data set, and that any process can call.

    Attributes:
        folder: folder of the data set.
        excerpt: its name and layout.
        columns: number of columns of the data set's `.bin` files; None to find
            the number from the values.
    """

    folder: Path
    excerpt: Excerpt
    columns: int | None

    def __call__(self) -> Drive:
        files = listed(self.folder, self.excerpt.scans)
        return _open_files(self.folder, self.excerpt, files, self.columns)

    def identity(self) -> list[list]:
        """Returns what identifies the data set: its name and its files."""
        drive = self()
        digests = file_digests(drive.files)
        names = [file.name for file in drive.files]
        return [
            [drive.name, self.excerpt.scans, self.columns],
            *map(list, zip(names, digests, strict=True)),
        ]


class RealScans(NamedTuple):
    """A data set of real scans that was found on the disk.

    Attributes:
        excerpt: name and origin of the data set.
        drive: scans and poses of the data set.
        source: opens the data set in any process.
    """

    excerpt: Excerpt
    drive: Drive
    source: ExcerptSource

    @property
    def name(self) -> str:
        return self.excerpt.folder


def open_excerpts(folder: Path, on_note: OnNote) -> list[RealScans]:
    """Returns the drives of the data sets in a folder.

    Notes name missing data sets, data sets with a wrong digest, and unknown
    folders.

    Raises:
        InputError: there is no data set, or one cannot be read.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder")
    known = {excerpt.folder for excerpt in EXCERPTS} | {IMAGES}
    scans = [
        listed(folder / excerpt.folder, excerpt.scans) for excerpt in EXCERPTS
    ]
    if not any(scans) and not (folder / IMAGES).is_dir():
        names = ", ".join(sorted(known))
        raise InputError(f"{folder}: no data set that is known ({names})")
    found = []
    for excerpt, files in zip(EXCERPTS, scans, strict=True):
        if not files:
            on_note(f"{excerpt.folder}/{excerpt.scans}: not there, skipped")
            continue
        digest = hashlib.sha256()
        for file in files:
            digest.update(read_bytes(file))
        columns = excerpt.columns
        if digest.hexdigest() != excerpt.digest:
            columns = None
            on_note(
                f"{folder / excerpt.folder}: other scans than known, still used"
            )
        source = ExcerptSource(
            (folder / excerpt.folder).absolute(), excerpt, columns
        )
        drive = source()
        for note in drive.notes:
            on_note(note)
        found.append(RealScans(excerpt, drive, source))
    for path in listed(folder):
        if path.is_dir() and path.name not in known:
            on_note(f"{path}: not known, left out")
    return found


def _open_files(
    folder: Path, excerpt: Excerpt, files: Sequence[Path], columns: int | None
) -> Drive:
    if excerpt.poses == "drive":
        return open_drive(folder)
    number = len(files)
    table = folder / "poses.txt"
    X_WS = np.tile(np.eye(4), (number, 1, 1))
    X_WS[:, 0, 3] = _APART * np.arange(number)
    if excerpt.poses == "matrices":
        X_WS = read_poses(table)
        if len(X_WS) != number:
            raise InputError(f"{table}: {len(X_WS)} rows for {number} scans")
    elif excerpt.poses:
        X_WS = _named_poses(table, files)
    options: dict = {
        "name": excerpt.folder,
        "world_frame": excerpt.world,
        "files": list(files),
        "stamps_ns": np.arange(number),
        "X_WS": X_WS,
        "tables": [table],
        "unit": excerpt.unit,
    }
    if excerpt.read is None and files[0].suffix == ".bin":
        return BinDrive(columns, **options)
    read = excerpt.read
    notes: list[str] = []
    if read is None:
        read = read_cloud
        read_cloud(files[0], on_note=notes.append)
    return FileDrive(
        read=lambda path, stamp_ns: read(path), notes=tuple(notes), **options
    )


def _named_poses(table: Path, files: Sequence[Path]) -> np.ndarray:
    """Returns the poses of scan files whose names are numbers, from a table."""
    try:
        numbers = np.array([int(file.stem) for file in files])
    except ValueError as error:
        raise InputError(
            f"{table.parent}: a scan's name is no number"
        ) from error
    return read_quaternions(table, None, in_order=False).at(numbers, 0)


def simulated_drives(
    folder: Path, unit: str, on_note: OnNote
) -> list[NamedDrive]:
    """Returns the drives in a folder whose LiDAR is like a given real LiDAR.

    Args:
        folder: folder of simulated drives.
        unit: name of a LiDAR preset, such as `hdl-64e`. Only drives with the
            same rows and columns of rays are returned.
        on_note: is called with notes on how these drives are read.

    Raises:
        InputError: a drive cannot be opened.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder")
    field = lidar_field(unit)
    alike = []
    for path in (entry for entry in listed(folder) if entry.is_dir()):
        if path.name == IMAGES:
            continue
        drive = open_drive(path)
        if field and drive.lidar_field == field:
            source = RecordingSource(path.absolute())
            alike.append(NamedDrive(drive.name, source, num_scans=len(drive)))
            for note in drive.notes:
                on_note(note)
    return alike
