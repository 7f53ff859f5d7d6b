"""What is recorded of a drive for its web page."""

from dataclasses import dataclass, field, replace
import math
from typing import NamedTuple
import zlib

import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform

# Scans that are kept while the drive is recorded; no page has more [bytes].
_MOST_KEPT = 26_000_000
# Points are rounded to a grid of 2 cm, about the noise of a LiDAR.
_GRID = 0.02
_LEVEL = 4
# Greatest level of an intensity.
_TOP_LEVEL = 63


class PackedScan(NamedTuple):
    """All points of a scan, as the page holds them.

    Attributes:
        frame: index of the frame.
        num_points: number N of points.
        origin: point of W from which the points are counted [m].
        grid: step of the coordinates [m].
        data: deflated bytes, 8 N before. The points go along one ring after the
            other. Each coordinate is the difference from the point before, as
            int16 modulo 2^16, with the sign in the lowest bit. First come the
            low bytes of all x, then their high bytes, then y and z. Last come
            two bytes of each point, as differences modulo 256: the intensity,
            and the kind.
    """

    frame: int
    num_points: int
    origin: tuple[int, int, int]
    grid: float
    data: bytes


def pack_scan(
    frame: int,
    p_WRset: np.ndarray,
    rings: np.ndarray,
    p_WB: np.ndarray,
    marks: np.ndarray,
) -> PackedScan:
    """Returns a scan as the page holds it.

    Args:
        frame: index of the frame.
        p_WRset: (N, 3) points in W [m].
        rings: (N,) ring of each point; points of a ring in their order of time.
        p_WB: (3,) where the vehicle is [m].
        marks: (N, 2) uint8, the intensity and the kind of each point.
    """
    origin = np.round(p_WB).astype(int)
    order = np.argsort(rings, kind="stable")
    p_ORset = (p_WRset - origin)[order]
    grid = _GRID
    while np.abs(p_ORset).max(initial=0.0) > 32_000 * grid:
        grid *= 2.0
    steps = np.diff(
        np.round(p_ORset / grid).astype("<i2"),
        axis=0,
        prepend=np.zeros((1, 3), "<i2"),
    )
    signless = ((steps << 1) ^ (steps >> 15)).astype("<u2")
    planes = signless.view(np.uint8).reshape(-1, 6).T.tobytes()
    planes += np.diff(
        marks[order], axis=0, prepend=np.zeros((1, 2), np.uint8)
    ).T.tobytes()
    x, y, z = origin.tolist()
    return PackedScan(
        frame, len(p_WRset), (x, y, z), grid, zlib.compress(planes, _LEVEL)
    )


@dataclass
class ScanRecord:
    """Evenly spaced scans of a drive, each whole.

    Attributes:
        num_frames: number of frames that the drive will have, if known.
        stride: one scan in so many frames is kept.
        scans: the scans.
        intensities: the range of intensities that levels distinguish, that of
            the first points but for the least and the greatest 2 %.
    """

    num_frames: int | None = None
    stride: int = 1
    scans: list[PackedScan] = field(default_factory=list)
    intensities: tuple[float, float] | None = None

    def wants(self, frame: int) -> bool:
        """Returns whether the scan of a frame is one of the kept."""
        return frame % self.stride == 0

    def intensity_levels(self, intensities: np.ndarray) -> np.ndarray:
        """Returns levels (N,) uint8 of intensities (N,), 0 to 63."""
        if self.intensities is None and len(intensities):
            low, high = np.percentile(intensities, [2.0, 98.0]).tolist()
            self.intensities = low, max(high, low + 1e-6)
        low, high = self.intensities or (0.0, 1.0)
        share = np.clip((intensities - low) / (high - low), 0.0, 1.0)
        return np.round(_TOP_LEVEL * share).astype(np.uint8)

    def add(self, scan: PackedScan) -> None:
        """Adds a scan, and keeps fewer of them if they become too large."""
        self.scans.append(scan)
        if len(self.scans) == 1 and self.num_frames is not None:
            expected = self.num_frames * len(scan.data)
            self.stride = max(1, math.ceil(expected / _MOST_KEPT))
        if sum(len(one.data) for one in self.scans) > _MOST_KEPT:
            del self.scans[1::2]
            self.stride *= 2

    def within(self, num_bytes: int) -> "ScanRecord":
        """Returns evenly spaced scans: as many as fit deflated, or one."""
        step = 1
        while step < len(self.scans) and num_bytes < sum(
            len(one.data) for one in self.scans[::step]
        ):
            step += 1
        return replace(
            self, stride=step * self.stride, scans=self.scans[::step]
        )


@dataclass(frozen=True)
class DriveRecord:
    """The record of a drive of F frames; most lists have one entry per frame.

    Attributes:
        period: time between frames [s].
        X_WBs: poses of the vehicle.
        X_WFs: id of a geometry frame that moves -> its poses.
        scans: the scans.
        sensors: a line of text for each sensor.
        speeds: forward speed of the vehicle [m/s].
        specific_forces_I: specific force in the IMU's frame I [m/s^2].
        angular_velocities_I: angular velocity w_WI_I [rad/s].
        limbs: maps the id of each moving object's root frame to the parts of
            the object. The parts map the id of a geometry frame to its constant
            pose in the root frame. Only the poses of the root frame are
            recorded. The vehicle has no entry.
        names: id of an object's root frame -> name of the object in the page.
        images: maps the name of a camera to the images to show. Each image is
            the index of its frame, and the image as JPEG.
    """

    period: float
    X_WBs: list[RigidTransform] = field(default_factory=list)
    X_WFs: dict[FrameId, list[RigidTransform]] = field(default_factory=dict)
    scans: ScanRecord = field(default_factory=ScanRecord)
    sensors: tuple[str, ...] = ()
    speeds: list[float] = field(default_factory=list)
    specific_forces_I: list[np.ndarray] = field(default_factory=list)
    angular_velocities_I: list[np.ndarray] = field(default_factory=list)
    limbs: dict[FrameId, dict[FrameId, RigidTransform]] = field(
        default_factory=dict
    )
    names: dict[FrameId, str] = field(default_factory=dict)
    images: dict[str, list[tuple[int, bytes]]] = field(default_factory=dict)
