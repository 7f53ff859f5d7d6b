"""Drives that are stored as one file for each scan."""

from collections.abc import Callable, Iterable, Mapping, Sequence
import filecmp
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evaluation.base import (
    FARTHEST_RETURN,
    InputError,
    check_range,
    listed,
    read_bytes,
    user_errors,
    value_errors,
)
from evaluation.clouds import bin_dtype
from evaluation.drives.drive import Drive, as_given, poses_frame
from evaluation.drives.drive_scenario import SCENARIO, read_scenario
from evaluation.drives.lidar_fields import LidarField, lidar_field
from evaluation.drives.stamped_poses import StampedPoses
from evaluation.drives.text_tables import check_increasing, parse_stamps_ns
from evaluation.drives.trajectories import read_trajectory


class PosedFiles(NamedTuple):
    """Files of N scans, with their poses.

    Attributes:
        files: N scans.
        stamps_ns: (N,) int64 [ns], strictly increasing.
        X_WS: (N, 4, 4) poses of the LiDAR in the world.
        notes: notes for the user on the poses.
        world_frame: name of W.
        tables: the files of the poses.
        datum: name of the survey grid in which W lies; None if there is none.
        has_own_world: see `evaluation.drives.Drive`.
    """

    files: list[Path]
    stamps_ns: np.ndarray
    X_WS: np.ndarray
    notes: tuple[str, ...] = ()
    world_frame: str = ""
    tables: tuple[Path, ...] = ()
    datum: str | None = None
    has_own_world: bool | None = None


class OwnPoses(NamedTuple):
    """The poses that a data set publishes with a drive.

    Attributes:
        trajectory: the poses as they are published.
        world_frame, tables, datum, has_own_world: see `PosedFiles`; by default,
            drives of the data set share W.
        X_WS: function that returns poses of the LiDAR in W, both (N, 4, 4),
            given published ones.
        note: note for the user; "" for none.
    """

    trajectory: StampedPoses
    world_frame: str
    tables: tuple[Path, ...]
    datum: str | None = None
    has_own_world: bool = False
    X_WS: Callable[[np.ndarray], np.ndarray] = lambda X: X
    note: str = ""


class FileDrive(Drive):
    """A drive with one file for each scan; the poses are in memory."""

    def __init__(
        self,
        path: Path,
        scans: PosedFiles,
        read: Callable[[Path, int], np.ndarray],
        *,
        name: str = "",
        tables: Iterable[Path] = (),
        notes: Iterable[str] = (),
        scenario: Mapping | None = None,
        unit: str | LidarField | None = None,
        lidar: str = "",
    ):
        """Describes a drive of N >= 1 scans.

        Args:
            path: its file or folder, which may hold a `scenario.yaml`.
            scans: its scans.
            read: function that returns the points in the file of a scan,
                unchanged. Its arguments are the file and the time of the scan
                [ns]. It raises ValueError if the file has another format.
            name: name of the drive, unless its scenario has a `name`; by
                default that of `path`.
            tables: all other files that are read. A path where there is no
                file is left out.
            notes: notes for the user on how the drive was read.
            scenario: the scenario of a drive without `scenario.yaml`.
            unit: the LiDAR, if the data set has only one, as in
                `evaluation.drives.lidar_field`.
            lidar: name of the LiDAR, if a drive can have several. It follows
                the name of the drive.

        Raises:
            InputError: see `read_scenario`.
        """
        self._scenario = read_scenario(path) or scenario
        named = (self._scenario or {}).get("name", name or as_given(path).name)
        self._session = str(named)
        self.name = f"{self._session}_{lidar}" if lidar else self._session
        self._lidar = lidar
        self.world_frame = scans.world_frame
        self.has_own_world = scans.has_own_world
        self._files = scans.files
        self._stamps_ns = scans.stamps_ns
        self._X_WS = scans.X_WS
        self._read = read
        tables = (*scans.tables, *tables, path / SCENARIO)
        self._tables = tuple(table for table in tables if table.is_file())
        self._notes = (*notes, *scans.notes)
        self._datum = scans.datum
        self._unit = unit

    def __len__(self) -> int:
        return len(self._files)

    @property
    def stamps_ns(self) -> np.ndarray:
        return self._stamps_ns

    @property
    def X_WS(self) -> np.ndarray:
        return self._X_WS

    @property
    def session(self) -> str:
        return self._session

    @property
    def files(self) -> tuple[Path, ...]:
        return (*self._tables, *self._files)

    @property
    def notes(self) -> tuple[str, ...]:
        return self._notes

    @property
    def datum(self) -> str | None:
        return self._datum

    @property
    def scenario(self) -> Mapping | None:
        return self._scenario

    @property
    def lidar_section(self) -> Mapping:
        lidars = (self.scenario or {}).get("lidars") or {}
        if self._lidar and [*lidars] != ["lidar"]:
            return lidars.get(self._lidar) or {}
        return super().lidar_section

    @property
    def lidar_field(self) -> LidarField | None:
        return super().lidar_field or lidar_field(self._unit)

    def scan(self, index: int) -> np.ndarray:
        if not 0 <= index < len(self):
            raise IndexError(f"scan {index} of {len(self)}")
        path = self._files[index]
        with user_errors(path), value_errors(path):
            points = self._read(path, int(self._stamps_ns[index]))
            check_range(points, FARTHEST_RETURN)
            return points[are_returns(points)]


class BinDrive(FileDrive):
    """A drive whose scans are `.bin` files: float32 without a header."""

    def __init__(self, columns: int | None, **drive: Any):
        """Describes a drive.

        Args:
            columns: number of float32 values per point; by default the field
                `columns` of the scenario, or as `read_cloud`.
            drive: all arguments of `FileDrive` except `read`.
        """
        super().__init__(read=self._read_bin, **drive)
        self._columns = columns or (self.scenario or {}).get("columns")

    def _read_bin(self, path: Path, stamp_ns: int) -> np.ndarray:
        return read_packed(path, bin_dtype(path, self._columns))


def list_stamped(
    folder: Path,
    suffix: str,
    parse: Callable[[np.ndarray], np.ndarray] = parse_stamps_ns,
) -> tuple[list[Path], np.ndarray]:
    """Returns the files in a folder whose names are times.

    Args:
        folder: folder of the files.
        suffix: suffix of their names.
        parse: function that converts an array of texts to times [ns].

    Returns:
        The files in order of time; (N,) int64 times [ns]; N >= 1.

    Raises:
        InputError: if there is no file, or a name is no time.
    """
    files = listed(folder, f"*{suffix}")
    if not files:
        raise InputError(f"{folder}: no scan (*{suffix}) in it")
    stems = [path.name.removesuffix(suffix) for path in files]
    with value_errors(f"{folder}: a file named *{suffix}"):
        stamps_ns = parse(np.array(stems))
    order = np.argsort(stamps_ns, kind="stable")
    check_increasing(folder, stamps_ns[order], "scan")
    return [files[i] for i in order], stamps_ns[order]


def first_existing(candidates: Iterable[Path], notes: list[str]) -> Path | None:
    """Returns the first of several files or folders that exists, or None.

    If other files or folders exist as well and differ from the first, a note is
    added to `notes`.
    """
    there: list[Path] = []
    for candidate in candidates:
        if candidate.exists() and not any(map(candidate.samefile, there)):
            there.append(candidate)
    if not there:
        return None
    first, *others = there
    others = [other for other in others if not _are_alike(first, other)]
    if others:
        named = ", ".join(map(str, others))
        notes.append(f"{first}: read; not read: {named}")
    return first


def _are_alike(first: Path, second: Path) -> bool:
    both = first.is_file() and second.is_file()
    return both and filecmp.cmp(first, second, shallow=False)


def posed(
    files: list[Path],
    stamps_ns: np.ndarray,
    own: Callable[[], OwnPoses],
    given: Path | None,
    pose_gap: float | None,
    numbers: Sequence[int] | None = None,
) -> PosedFiles:
    """Gives scan files their poses: those that a user gives, or the drive's.

    Args:
        files: files of all N scans, even those without ground truth.
        stamps_ns: (N,) their stamps [ns].
        own: function that returns the drive's own poses.
        given: file with poses of the LiDAR, see `read_trajectory`.
        pose_gap: see `StampedPoses.at_scans`.
        numbers: see `read_trajectory`.

    Returns:
        The files between the first and the last pose, and notes, see
        `StampedPoses.at_scans`.

    Raises:
        InputError: poses cannot be read, or a scan has none.
    """
    if given is None:
        found = own()
    else:
        trajectory = read_trajectory(given, stamps_ns, numbers)
        found = OwnPoses(trajectory, poses_frame(given), (given,))
    kept, X, notes = found.trajectory.at_scans(stamps_ns, pose_gap)
    return PosedFiles(
        files[kept],
        stamps_ns[kept],
        found.X_WS(X),
        (*notes, *filter(None, [found.note])),
        found.world_frame,
        found.tables,
        found.datum,
        found.has_own_world,
    )


def read_packed(path: Path, dtype: np.dtype) -> np.ndarray:
    """Returns the records of a file without a header.

    Raises:
        ValueError: if the last record is incomplete.
        InputError: if the file cannot be read.
    """
    data = read_bytes(path)
    if len(data) % dtype.itemsize:
        raise ValueError(
            f"{len(data)} bytes is no whole number of points of"
            f" {dtype.itemsize} bytes (cut off, or of another sensor)"
        )
    return np.frombuffer(data, dtype=dtype)


def check_below(points: np.ndarray, name: str, limit: int) -> None:
    """Raises an error if a field shows that a file is from another sensor.

    Args:
        points: structured array (N,).
        name: name of the field.
        limit: number that the values of the sensor do not reach.

    Raises:
        ValueError: if `points[name]` reaches `limit`.
    """
    if len(points) and points[name].max() >= limit:
        raise ValueError(
            f"{name}: {points[name].max()} is not below {limit} (of another"
            " sensor)"
        )


def are_returns(points: np.ndarray) -> np.ndarray:
    """Returns which points (N,) are not at the origin, as beams without return.

    Ouster and Livox, for example, write points for all beams.
    """
    is_return = np.zeros(len(points), dtype=bool)
    for name in "xyz":
        is_return |= points[name] != 0.0
    return is_return
