"""What feature extraction finds in a drive: its map, descriptors and scans."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math

import numpy as np
from numpy.lib.recfunctions import repack_fields

from cns_drake.base import fingerprint, xyz
from evaluation.change import DriveMap
from evaluation.drives import within_cube
from evaluation.maps import VoxelMap
from evaluation.recognition import DriveDescriptors, RetrievalProtocol

# Fields of the points of kept scans, where a drive has them.
_KEPT_FIELDS = ("x", "y", "z", "instance")


@dataclass(frozen=True)
class DriveSummary:
    """A drive with its map, and with its scans reduced to small pictures.

    Attributes:
        name: name of the drive.
        stamps_ns: (N,) int64 time stamps of all frames [ns].
        X_WS: (N, 4, 4) poses of the sensor at all frames.
        coarse: the map, in voxels of 1 m from which the change ratio (TCR) is
            computed.
        frames: (K,) frames that are places or queries; empty if the drive has
            neither.
        thumbnails: K reduced scans at these frames, see
            `evaluation.maps.thumbnails`.
    """

    name: str
    stamps_ns: np.ndarray
    X_WS: np.ndarray
    coarse: VoxelMap
    frames: np.ndarray
    thumbnails: list[np.ndarray]

    @property
    def positions(self) -> np.ndarray:
        """(N, 3) positions of the sensor in the world [m]."""
        return self.X_WS[:, :3, 3]

    @property
    def drive_map(self) -> DriveMap:
        """The voxel map of the drive, with the drive's name and positions."""
        return DriveMap(self.name, self.coarse, self.positions)


@dataclass(frozen=True)
class KeptScans:
    """A drive with only the scans of its places and queries.

    Attributes:
        name: name of the drive.
        X_WS: (N, 4, 4) poses of the sensor at all frames.
        instances: instance id of a structure -> its name and class; None if
            unknown.
        frames: (K,) frames whose scans were kept, in ascending order.
        scans: K structured arrays (M,) with coordinates and instance ids of the
            points within range; see `kept_points`.
    """

    name: str
    X_WS: np.ndarray
    instances: Mapping[int, Mapping] | None
    frames: np.ndarray
    scans: Sequence[np.ndarray]

    def __len__(self) -> int:
        """Returns the number of frames of the drive."""
        return len(self.X_WS)

    def scan(self, index: int) -> np.ndarray:
        """Returns the scan of a frame, which must have been kept."""
        row = int(np.searchsorted(self.frames, index))
        if row == len(self.frames) or self.frames[row] != index:
            raise KeyError(index)
        return self.scans[row]


def kept_points(scan: np.ndarray, half_extent: float) -> np.ndarray:
    """Returns the points of a scan that any rotation of the sensor may need.

    Args:
        scan: structured array (M,) in the sensor's frame.
        half_extent: limit of the coordinates in the frame of the rotated sensor
            [m]. A point is kept if some rotation of the sensor can bring all
            its coordinates within this limit.

    Returns:
        Structured array (K,) of x, y, z and, if the scan has it, the instance.
    """
    # A corner of the cube may lie on an axis of a rotated sensor.
    half_extent *= math.sqrt(3.0)
    names = [one for one in scan.dtype.names or () if one in _KEPT_FIELDS]
    kept = within_cube(xyz(scan), half_extent)
    # A view would hold all fields, and a subclass could not be stored.
    return repack_fields(np.asarray(scan)[names][kept])


@dataclass(frozen=True)
class ExtractedFeatures:
    """What every reading of a recording yields: its descriptors.

    Attributes:
        described: key of a method -> its descriptors of the places and
            queries; empty if the drive has neither.
    """

    described: dict[str, DriveDescriptors]


@dataclass(frozen=True)
class MappedFeatures(ExtractedFeatures):
    """The features of a drive that is mapped.

    Attributes:
        drive: the drive with its map.
        fine: (K, 3) cloud for pictures in W [m].
        recorded_scans: scans of places and queries as they were recorded; None
            if they are not kept.
    """

    drive: DriveSummary
    fine: np.ndarray
    recorded_scans: KeptScans | None


@dataclass(frozen=True)
class ScannedFeatures(ExtractedFeatures):
    """The features of a drive of which only places and queries are read.

    Attributes:
        shown_scans: scans (N, 3) float32 of places and queries, as methods get
            them: within range, and those of queries changed as the protocol
            says (rotated, tilted or without a sector) [m].
    """

    shown_scans: Sequence[np.ndarray]


def described_key(method: str, protocol: RetrievalProtocol) -> str:
    """Returns the key in `ExtractedFeatures.described` for a further protocol.

    Descriptors by the study's main protocol have the key of the method. Use
    this function for descriptors by any other protocol.

    Args:
        method: key of the method.
        protocol: the further protocol.
    """
    return f"{method},{fingerprint(protocol.descriptor_options())[:6]}"
