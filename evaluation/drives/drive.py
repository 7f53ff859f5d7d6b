"""The interface of every recorded drive, in any format."""

import abc
from collections.abc import Iterator, Mapping
import os
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from evaluation.base import InputError
from evaluation.drives.drive_scenario import driven_way
from evaluation.drives.lidar_fields import LidarField, lidar_field
from evaluation.lidar_sheets import DEFAULT_PRESET

# W is the world, B the vehicle on the ground, I the IMU. The pose is X_WB. Both
# velocities are velocities of B in W, expressed in B [m/s, rad/s].
ODOMETRY_DTYPE = np.dtype(
    [
        ("stamp_ns", "<i8"),
        ("position", "<f8", 3),
        ("quat_xyzw", "<f8", 4),
        ("velocity", "<f8", 3),
        ("angular_velocity", "<f8", 3),
    ]
)

# The orientation is R_WI; the other values are expressed in I [rad/s, m/s^2].
IMU_DTYPE = np.dtype(
    [
        ("stamp_ns", "<i8"),
        ("quat_xyzw", "<f8", 4),
        ("angular_velocity", "<f8", 3),
        ("specific_force", "<f8", 3),
    ]
)


class ImuSamples(NamedTuple):
    """Consecutive samples of an IMU with a constant rate.

    Attributes:
        first: number of the first sample of this block; the sample at time zero
            has the number 0.
        quat_xyzw: (N, 4) orientations R_WI of the IMU I in the world W, as unit
            quaternions (x, y, z, w).
        angular_velocity: (N, 3) w_WI, expressed in I [rad/s].
        specific_force: (N, 3) expressed in I [m/s^2].
    """

    first: int
    quat_xyzw: np.ndarray
    angular_velocity: np.ndarray
    specific_force: np.ndarray


_Made = TypeVar("_Made", bound="Drive")
# Frames that drives share by convention. By REP 105 of ROS, other frames, such
# as `odom`, begin anew in each drive.
SHARED_FRAMES = ("map", "utm", "earth", "world", "enu")
# How the name of the world frame of a user's file of poses begins.
POSES_FRAME = "poses"


class Drive(abc.ABC):
    """A recorded drive: the scans of one LiDAR, with their poses and times.

    Frames: W is the world, which all drives of the same map share; S is the
    LiDAR.

    A scan is read on each access and not kept, so a drive can be larger than
    memory.

    Attributes:
        name: short name for tables and messages, e.g. `metropolis_04`.
        world_frame: name of W, as stated in the recording.
        has_own_world: whether W is a frame of this drive alone, which its name
            then says. None if the name of W decides: frames other than
            `SHARED_FRAMES` are of one drive, unless its scenario names a map.
        placing: how drives of this format get a common world frame, for errors;
            in brackets, after a space.

    Example:
        from evaluation import open_drive

        drive = open_drive("recordings/downtown_01")
        print(len(drive), drive.X_WS[0], drive.scan(0).dtype)
    """

    name: str
    world_frame: str
    has_own_world: bool | None = None
    placing: str = ""
    _made_of: tuple[tuple, dict]

    def __new__(cls: type[_Made], *args: Any, **kwargs: Any) -> _Made:
        """Keeps the arguments, with which other processes open it again."""
        drive = super().__new__(cls)
        drive._made_of = args, kwargs
        return drive

    def __reduce__(self) -> tuple:
        return _opened_again, (type(self), *self._made_of)

    @abc.abstractmethod
    def __len__(self) -> int:
        """The number of scans N."""

    @property
    @abc.abstractmethod
    def stamps_ns(self) -> np.ndarray:
        """(N,) int64 time of each scan [ns], strictly increasing."""

    @property
    @abc.abstractmethod
    def X_WS(self) -> np.ndarray:
        """(N, 4, 4) float64 pose of the LiDAR at each scan's stamp."""

    @property
    def world(self) -> str:
        """Name of the world W: equal for two drives only if they share it."""
        if self.has_own_world is not None or not self.is_local:
            return self.world_frame
        home = self.files[0].resolve() if self.files else f"/{self.name}"
        return f"{self.world_frame}{home}"

    @property
    def is_local(self) -> bool:
        """Whether the world W is a frame of this drive alone."""
        if self.has_own_world is not None:
            return self.has_own_world
        has_map = (self.scenario or {}).get("map") is not None
        return not (has_map or self.world_frame in SHARED_FRAMES)

    @property
    def motion(self) -> tuple[np.ndarray, np.ndarray]:
        """All recorded poses of the LiDAR, at least one for each scan.

        Returns:
            Stamps (M,) [ns], strictly increasing, and poses X_WS (M, 4, 4).
        """
        return self.stamps_ns, self.X_WS

    @abc.abstractmethod
    def scan(self, index: int) -> np.ndarray:
        """Returns one scan as an array of points.

        Args:
            index: number of the scan, 0 <= index < N.

        Returns:
            Structured array, one record per return, with at least `x`, `y`
            and `z` [m], expressed in S.

        Raises:
            InputError: if the scan cannot be read.
        """

    def __iter__(self) -> Iterator[np.ndarray]:
        """Yields the scans in order, reading one at a time."""
        for index in range(len(self)):
            yield self.scan(index)

    @property
    def odometry(self) -> np.ndarray | None:
        """Poses and velocities of the vehicle; None if not recorded.

        An array (M,) of dtype `evaluation.drives.drive.ODOMETRY_DTYPE`:
        position [m] and orientation of the vehicle B in the world W, and its
        velocities, expressed in B [m/s, rad/s].
        """
        return None

    @property
    def imu(self) -> np.ndarray | None:
        """Samples of the IMU I; None if not recorded.

        An array (M,) of dtype `evaluation.drives.drive.IMU_DTYPE`:
        orientation R_WI, and angular velocity [rad/s] and specific force
        [m/s^2], both expressed in I.
        """
        return None

    @property
    def X_BS(self) -> np.ndarray | None:
        """Pose (4, 4) of the LiDAR on the vehicle B; None if not recorded."""
        return None

    @property
    def X_BI(self) -> np.ndarray | None:
        """Pose (4, 4) of the IMU I on the vehicle B; None if not recorded."""
        return None

    @property
    def kalibr(self) -> str | None:
        """Noise of the IMU as text in Kalibr's file format; None without noise.

        Raises:
            InputError: what was recorded is no text.
        """
        return None

    @property
    def image_stamps_ns(self) -> np.ndarray:
        """(M,) int64 time of each image of the first camera [ns]."""
        return np.zeros(0, np.int64)

    def image(self, index: int) -> bytes:
        """Returns image `index` of the first camera, encoded, e.g. as JPEG.

        Raises:
            InputError: if the image cannot be read.
        """
        raise IndexError(f"image {index} of {len(self.image_stamps_ns)}")

    @property
    def datum(self) -> str | None:
        """Name of the survey grid in which the world frame W lies, or None.

        If two drives have the same survey grid, their world frames differ only
        by the positioning error of the drives, about ten metres.
        """
        return None

    @property
    def session(self) -> str:
        """Name of the drive, without the name of its LiDAR.

        If the drive has no scenario, its map and stage are found from this
        name.
        """
        return self.name

    @property
    def files(self) -> tuple[Path, ...]:
        """All files from which the drive, its scans and its labels are read.

        Results of the drive are kept until one of these files changes. For a
        drive that is not read from files, the list is empty.
        """
        return ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes for the user on how the recording was read."""
        return ()

    @property
    def distortion_note(self) -> str | None:
        """A note for the user if the scans contain motion distortion.

        The value is None if the scans contain no motion distortion, and for
        recordings of real LiDARs, which do not state whether their scans are
        distorted.
        """
        return None

    @property
    def lidar_names(self) -> tuple[str, ...]:
        """Names of the LiDARs; the first is the one that is read by default.

        The names are unknown, and so empty, if the format has none.
        """
        return ()

    @property
    def lidar_name(self) -> str:
        """Name of the LiDAR whose scans are read; empty if unknown."""
        return ""

    @property
    def scenario(self) -> Mapping | None:
        """The scenario of a simulated drive; None if not recorded.

        A mapping field -> value with the fields of the scenario file.
        """
        return None

    @property
    def lidar_section(self) -> Mapping:
        """Settings of the drive's LiDAR; empty if no scenario contains them.

        A scenario may have several LiDARs. If the name of the drive ends in
        `_<lidar>`, by the longest such name, the settings of that LiDAR are
        returned, otherwise the settings of the first LiDAR.
        """
        lidars = (self.scenario or {}).get("lidars")
        if not isinstance(lidars, dict) or not lidars:
            return {}
        # The name of a LiDAR can be the end of another's.
        name = max(
            (name for name in lidars if self.name.endswith(f"_{name}")),
            key=len,
            default=next(iter(lidars)),
        )
        return lidars[name] if isinstance(lidars[name], dict) else {}

    @property
    def lidar_field(self) -> LidarField | None:
        """Rings and field of view of the LiDAR; None for an unknown model."""
        section = self.lidar_section
        scenario = self.scenario
        if driven_way(scenario) and "lidars" not in (scenario or {}):
            section = {"preset": DEFAULT_PRESET}
        unit = section.get("unit") or section.get("preset")
        return lidar_field(unit, section.get("rings"))

    @property
    def instances(self) -> Mapping[int, Mapping] | None:
        """Maps instance ids to structures; None if not recorded.

        A structure is a mapping with the keys `name`, `class` and `label`. The
        points of the scans carry the same instance ids and labels.
        """
        return None


def _opened_again(kind: type[Drive], args: tuple, kwargs: dict) -> Drive:
    return kind(*args, **kwargs)


def poses_frame(path: Path) -> str:
    """Returns the name of the world frame of a user's file of poses."""
    return f"{POSES_FRAME}{path.resolve()}"


def as_given(path: Path) -> Path:
    """Returns the absolute path of a drive, whose links are not resolved.

    A drive has the name that its user gave it, and its tables lie beside this
    name, wherever a link leads.
    """
    return Path(os.path.abspath(path))


def index_instances(table: Any, source: str) -> dict[int, Mapping]:
    """Returns the structures in a recording's structure table, by instance id.

    Args:
        table: parsed JSON: a list of structures, each a mapping with the key
            `instance` and other properties.
        source: name of the file, with which an error message begins.

    Raises:
        InputError: if `table` is not such a list.
    """
    try:
        return {entry["instance"]: entry for entry in table}
    except (TypeError, KeyError) as error:
        raise InputError(
            f"{source}: no list of entries with an instance"
        ) from error
