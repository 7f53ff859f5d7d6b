"""Opening a recorded drive with the reader for its format."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import inspect
import math
from pathlib import Path
from typing import Any

from evaluation.base import (
    Family,
    doing,
    errors_at,
    import_modules,
    listed,
    reads,
)
from evaluation.base import InputError as InputError
from evaluation.clouds import is_cloud
from evaluation.drives.data_set import DataSet, check_interface
from evaluation.drives.drive import Drive
from evaluation.drives.posed_drive import PosedDrive

# Endings of packed files, of which none is a drive.
_PACKED = (".gz", ".bz2", ".xz", ".zst", ".zstd", ".lz4", ".zip", ".7z", ".tar")


@dataclass(frozen=True)
class Reading:
    """What a recording does not say itself: how it is read.

    Attributes:
        lidar, columns, odometry, poses, pose_gap: see `open_drive`.
    """

    lidar: str | None = None
    columns: int | None = None
    odometry: str | None = None
    poses: Path | None = None
    pose_gap: float | None = None

    @classmethod
    def each(cls, count: int, **options: Any) -> list[Reading]:
        """Returns how each of some drives is read.

        Args:
            count: number of drives.
            options: field -> value for all drives, or a list of a value for
                each drive, in their order.

        Raises:
            InputError: a list has another length.
        """
        columns = {}
        for name, value in options.items():
            values = value if isinstance(value, list | tuple) else [value]
            if len(values) not in (1, count):
                raise InputError(
                    f"--{name}: given {len(values)} times; give it once for"
                    f" all drives, or {count} times, in their order"
                )
            columns[name] = values * (count // len(values))
        return [
            cls(**{name: values[k] for name, values in columns.items()})
            for k in range(count)
        ]

    def open(self, path: Path) -> Drive:
        """Opens a recorded drive, as `open_drive` does."""
        return open_drive(path, **vars(self))

    def open_source(self, path: Path) -> Drive | Path:
        """Opens a recorded drive; returns the path of a point cloud.

        Raises:
            InputError: the path can be read as neither.
        """
        path = Path(path)
        if path.is_file() and is_cloud(path):
            return path
        return self.open(path)


@reads
def open_drive(
    path: Path,
    lidar: str | None = None,
    columns: int | None = None,
    *,
    odometry: str | None = None,
    poses: Path | None = None,
    pose_gap: float | None = None,
) -> Drive:
    """Opens a recorded drive with the reader for its format.

    Args:
        path: an .mcap file; a folder with such a file, as cns-drake and rosbag2
            write it; or a drive's folder, as one of `data_sets` publishes it.
            `LiDAR/<name>` in a folder of HeLiPR chooses the LiDAR.
        lidar: name of the LiDAR to read, if the recording has several LiDARs.
        columns: number of float32 values per point in `.bin` files of KITTI and
            MulRan; by default the field `columns` of the drive's
            `scenario.yaml`, or four, or five for files named `*.pcd.bin`.
        odometry: topic of the poses, if a recording of ROS has several.
        poses: file with the poses of the LiDAR, which are used instead of those
            of the recording: in the form of TUM (seconds, x y z, quaternion
            x y z w), of a table whose header names these columns, or of KITTI
            (3 x 4 matrices, one for each scan).
        pose_gap: greatest time between two recorded poses that are interpolated
            [s]; by default 1.

    Raises:
        InputError: if nothing at `path` can be read as a drive, or the drive
            has no such LiDAR or topic, or no poses.

    Example:
        from evaluation import open_drive

        for scan in open_drive("recordings/downtown_01"):
            print(len(scan))
    """
    path = Path(path)
    poses = None if poses is None else Path(poses)
    if not path.exists():
        raise InputError(f"{path}: no such file or folder")
    doing(f"opening {path.name}")
    fitting = find_data_sets(path)
    if len(fitting) > 1:
        names = ", ".join(one.title for one in fitting)
        raise InputError(f"{path}: files of several formats ({names})")
    if fitting:
        found: Any = fitting[0]
        if not found.has_lidars and lidar is not None:
            raise InputError(f"{path}: has one LiDAR, not a '{lidar}'")
        arguments = inspect.signature(found.open).parameters
        if odometry is not None and "odometry" not in arguments:
            raise InputError(
                f"{path}: {found.title}: has no topics of poses, as --odometry"
                " names one"
            )
        if pose_gap is not None:
            if not 0.0 < pose_gap < math.inf:
                raise InputError(f"--pose-gap: {pose_gap:g} is not above 0")
            if "pose_gap" not in arguments and poses is None:
                raise InputError(
                    f"{path}: {found.title}: interpolates no poses, as"
                    " --pose-gap limits"
                )
        named: dict[str, Any] = {
            "odometry": odometry,
            "poses": poses,
            "pose_gap": pose_gap,
        }
        given = lidar if found.has_lidars else columns
        asked = {name: one for name, one in named.items() if name in arguments}
        if found.is_own:
            drive = found.open(path, given, **asked)
        else:
            drive = _open_others(found, path, given, **asked)
        if poses is not None and "poses" not in arguments:
            drive = PosedDrive(drive, poses, pose_gap)
        return drive
    if path.is_dir() and any(path.glob(".*.mcap.*.part")):
        raise InputError(
            f"{path}: the recording was not finished; simulate the drive again"
        )
    for file in listed(path) if path.is_dir() else [path]:
        if file.suffix.lower().endswith(_PACKED):
            raise InputError(f"{file}: a packed file; unpack it first")
    titles = [one.title for one in data_sets().values() if one.title != "MCAP"]
    raise InputError(
        f"{path}: not a recorded drive (a folder with an .mcap file, or"
        f" one, or a drive of {', '.join(titles[:-1])} or {titles[-1]})"
    )


def _open_others(
    data_set: DataSet, path: Path, *words: Any, **named: Any
) -> Drive:
    """Opens a drive of a plug-in's data set, whose interface is checked."""
    with errors_at(f"{path}: data set {data_set.title}"):
        try:
            drive = data_set.open(path, *words, **named)
            check_interface(drive)
        except TypeError as error:  # Such as an incomplete class.
            raise InputError(error) from error
    return drive


def register_data_set(data_set: DataSet) -> DataSet:
    """Registers a data set of your own, whose drives `open_drive` then opens.

    Args:
        data_set: the data set; all commands take its drives.

    Raises:
        InputError: it is no data set, or a field has another type.
        ValueError: there is another data set with this title.

    Example:
        from evaluation import DataSet, register_data_set

        register_data_set(
            DataSet("Mine", is_mine, open_mine, "the folder with `mine.txt`")
        )
    """
    if not isinstance(data_set, DataSet):
        raise InputError(f"{data_set!r} is no DataSet")
    for name in ("title", "files"):
        if not isinstance(getattr(data_set, name), str):
            raise InputError(f"data set {data_set.title!r}: {name}: no text")
    for name in ("holds", "open"):
        if not callable(getattr(data_set, name)):
            raise InputError(
                f"data set {data_set.title!r}: {name}: no function"
            )
    _DATA_SETS.load_own()
    _add(data_set)
    return data_set


def data_sets() -> Mapping[str, DataSet]:
    """Returns the data sets by their titles in lower case."""
    return _DATA_SETS


def _load_own() -> None:
    # Imported late: the readers' libraries are slow to load, and a map file
    # needs none of them.
    for module in import_modules(str(__package__)).values():
        if hasattr(module, "DATA_SET"):
            _add(module.DATA_SET)


_DATA_SETS: Family[DataSet] = Family("data set", _load_own)


def _add(data_set: DataSet) -> None:
    source = data_set.holds.__module__, data_set.holds.__qualname__
    _DATA_SETS.add(data_set.title.lower(), data_set, source)


def find_data_sets(path: Path) -> list[DataSet]:
    """Returns the data sets whose layout a file or folder has."""
    return [one for one in data_sets().values() if one.holds(path)]
