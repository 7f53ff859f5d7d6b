"""What is read of a drive, once: descriptors, scans, a map and a picture."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
import math
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.lib.recfunctions import repack_fields

from evaluation.base import (
    InputError,
    Key,
    LongList,
    Store,
    doing,
    make_folder,
    xyz,
)
from evaluation.drives import (
    Drive,
    RecentScans,
    cropped,
    sample_frames,
    within_cube,
)
from evaluation.maps import (
    CELL_SIZE,
    MappedDrive,
    VoxelMap,
    map_drive,
    thumbnail,
)
from evaluation.methods import MethodConfig
from evaluation.recognition.chosen_methods import MethodChoice
from evaluation.recognition.describing import Role, describe_drive
from evaluation.recognition.protocol import RetrievalProtocol

# Counts the changes of what is read of the same drive.
_VERSION = 2
# Fields of the points of kept scans, where a drive has them.
_KEPT_FIELDS = ("x", "y", "z", "instance")


@dataclass(frozen=True)
class Descriptors:
    """Asks for a method's descriptors: a `DriveDescriptors`.

    Attributes:
        method: the method.
        role: which scans are described.
        protocol: chooses the scans, and says how queries are seen.
    """

    method: MethodChoice
    role: Role
    protocol: RetrievalProtocol

    def identity(self) -> dict[str, object]:
        protocol = self.protocol.of(self.method.make())
        return {
            "method": self.method.identity(),
            "role": self.role,
            "protocol": protocol.descriptor_options(
                queries=self.role == "queries"
            ),
        }


@dataclass(frozen=True)
class DescribingTime:
    """Asks what descriptors have taken: a `DescribingCost`.

    Attributes:
        of: the descriptors.
    """

    of: Descriptors

    def identity(self) -> dict[str, object]:
        return self.of.identity()


@dataclass(frozen=True)
class Scans:
    """Asks for scans, without what no query can see: a `KeptScans`.

    Attributes:
        spacing: distance driven between two of them [m].
        half_extent: see `RetrievalProtocol`.
    """

    spacing: float
    half_extent: float

    def identity(self) -> dict[str, object]:
        return {"spacing": self.spacing, "half_extent": self.half_extent}


@dataclass(frozen=True)
class Map:
    """Asks for the voxel map of a drive, a `DriveMapping`.

    Attributes:
        spacing: distance driven between two scans in the map [m]; None for all
            scans.
    """

    spacing: float | None = None

    def identity(self) -> dict[str, object]:
        return {"spacing": self.spacing}


@dataclass(frozen=True)
class Picture:
    """Asks for what a page shows of a drive: a `DrivePicture`.

    Attributes:
        spacings: distances driven between two scans that are shown [m].
        half_extent: greatest absolute x, y and z of a point of these scans [m].
    """

    spacings: tuple[float, ...]
    half_extent: float

    def identity(self) -> dict[str, object]:
        return {
            "spacings": list(self.spacings),
            "half_extent": self.half_extent,
        }


Asked: TypeAlias = "Descriptors | DescribingTime | Scans | Map | Picture"


@dataclass(frozen=True)
class DriveMapping:
    """The map of a drive, and its poses.

    Attributes:
        name: name of the drive.
        stamps_ns: (N,) int64 time stamps of all frames [ns].
        X_WS: (N, 4, 4) poses of the sensor at all frames.
        voxels: the map, in voxels of 1 m from which the change ratio (TCR) is
            computed.
    """

    name: str
    stamps_ns: np.ndarray
    X_WS: np.ndarray
    voxels: VoxelMap


@dataclass(frozen=True)
class DrivePicture:
    """What a page shows of a drive.

    Attributes:
        fine: (K, 3) cloud of the whole drive, in W [m].
        frames: (F,) frames whose scans are shown.
        thumbnails: F reduced scans at these frames, see
            `evaluation.maps.thumbnails`.
    """

    fine: np.ndarray
    frames: np.ndarray
    thumbnails: Sequence[np.ndarray]


@dataclass(frozen=True)
class KeptScans:
    """A drive with only some of its scans.

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


@dataclass(eq=False)
class DriveData:
    """A drive that is read once for all that is asked of it.

    What was read is in memory, descriptors until they are taken; with a store,
    it is in files.

    Attributes:
        source: opens the drive.
        asked: what is asked of the drive.
        drive: digest of the drive's identity; "" if nothing is stored.
        store: where to keep what is read; None for the memory.
    """

    source: Callable[[], Drive]
    asked: tuple[Asked, ...]
    drive: str = ""
    store: Store | None = None
    _found: dict[Asked, Any] | None = field(default=None, repr=False)

    def key(self, one: Asked) -> Key:
        """Returns the key of something asked."""
        return asked_key(self.drive, one)

    def missing(self) -> list[Asked]:
        """Returns what is asked and is not in the store."""
        store = self.store
        return [
            one
            for one in self.asked
            if store is None or not store.has(self.key(one))
        ]

    def fill(self) -> None:
        """Reads the drive if anything is missing in the store.

        Raises:
            InputError: the drive cannot be read, or a file not be written.
        """
        if (store := self.store) is None or not (missing := self.missing()):
            return
        make_folder(store.folder)
        found = gathered(self.source(), missing, store.folder)
        doing("writing maps and descriptors")
        for one, value in found.items():
            store.write(self.key(one), value)

    def reader(self, one: Asked) -> tuple[Callable[[], Any], float]:
        """Returns a function that returns something asked, and its size.

        Descriptors that are in memory leave it with this function.

        Returns:
            The function; approximate size of its result [bytes].
        """
        if self.store is not None:
            part = self.store.part(self.key(one))
            return part.read, part.size()
        if self._found is None:
            self._found = gathered(self.source(), self.asked)
        # Others than descriptors are small, or are asked for more than once.
        value = self._found[one]
        if isinstance(one, Descriptors):
            del self._found[one]
        of_places = getattr(getattr(value, "places", None), "descriptors", None)
        return lambda: value, getattr(of_places, "num_bytes", 0)

    def take(self, one: Asked) -> Any:
        """Returns something asked; descriptors leave the memory."""
        return self.reader(one)[0]()


def asked_key(drive: str, one: Asked) -> Key:
    """Returns the key of something asked of a drive, given by its digest."""
    kind = type(one).__name__.lower()
    return Key(kind, {"drive": drive, **one.identity()}, _VERSION)


def gathered(
    recording: Drive, asked: Collection[Asked], folder: Path | None = None
) -> dict[Asked, Any]:
    """Returns all that is asked of a drive; each scan is read once, in order.

    Args:
        recording: the drive.
        asked: what is asked. With `Descriptors`, the result also has their
            `DescribingTime`.
        folder: existing folder for temporary files of long drives; None for the
            system's folder.

    Raises:
        InputError: the drive cannot be read, or lacks points.
    """
    # Queries that are seen like places get their descriptors.
    described = sorted(
        (one for one in asked if isinstance(one, Descriptors)),
        key=lambda one: one.role,
    )
    requests = [
        (one.method.make(), {one.role}, one.protocol) for one in described
    ]
    most = max((p.scans(method) for method, _, p in requests), default=1)
    is_mapped = any(isinstance(one, Picture) or one == Map() for one in asked)
    drive = (MappedDrive if is_mapped else RecentScans)(recording, most)
    found: dict[Asked, Any] = {}
    visits: list[_Visit] = []
    for one in asked:
        if isinstance(one, Scans):
            visits.append(_Visit(one, drive, [one.spacing], folder))
        elif isinstance(one, Picture):
            visits.append(_Visit(one, drive, one.spacings, folder))
    visited: dict[int, list[_Visit]] = {}
    for visit in visits:
        for frame in visit.frames.tolist():
            visited.setdefault(frame, []).append(visit)

    def keep(frame: int) -> None:
        for visit in visited.get(frame, ()):
            visit.keep(drive.scan(frame), frame)

    costs: list[Any] = []
    results = describe_drive(
        drive,
        (),
        frozenset(),
        visit=keep,
        visited=visited,
        further=requests,
        make_list=partial(LongList, folder),
        costs=costs,
    )
    for one, result, cost in zip(described, results, costs, strict=True):
        found[one] = result
        found[DescribingTime(one)] = cost
    for visit in visits:
        if isinstance(visit.of, Scans):
            found[visit.of] = visit.scans(recording)
    for one in asked:
        if isinstance(one, Map) and one.spacing is not None:
            frames = sample_frames(drive.X_WS[:, :3, 3], one.spacing)
            voxels = map_drive(drive, CELL_SIZE, frames.tolist())
            found[one] = _mapping(drive, voxels)
    if isinstance(drive, MappedDrive):
        coarse, fine = drive.finish()
        if len(coarse) == 0:
            raise InputError(f"{drive.name}: no scan holds a point")
        for one in asked:
            if one == Map():
                found[one] = _mapping(drive, coarse)
        for visit in visits:
            if isinstance(visit.of, Picture):
                found[visit.of] = DrivePicture(fine, visit.frames, visit.kept)
    return found


def _mapping(drive: Drive, voxels: VoxelMap) -> DriveMapping:
    return DriveMapping(drive.name, drive.stamps_ns, drive.X_WS, voxels)


class _Visit:
    """Scans of a drive that are kept, whole or as thumbnails."""

    def __init__(
        self,
        of: Scans | Picture,
        drive: Drive,
        spacings: Iterable[float],
        folder: Path | None,
    ):
        self.of = of
        p_WSs = drive.X_WS[:, :3, 3]
        frames = [sample_frames(p_WSs, one) for one in spacings]
        self.frames = np.unique(np.concatenate(frames))
        self.kept: LongList = LongList(folder)

    def keep(self, scan: np.ndarray, frame: int) -> None:
        if isinstance(self.of, Scans):
            self.kept.append(kept_points(scan, self.of.half_extent))
            return
        # Pictures show the scan as recorded, whatever its query sees.
        height = MethodConfig().sensor_height
        shown = cropped(scan, self.of.half_extent)
        self.kept.append(thumbnail(shown, height, seed=frame))

    def scans(self, drive: Drive) -> KeptScans:
        known = drive.instances
        return KeptScans(
            drive.name,
            drive.X_WS,
            known and dict(known),
            self.frames,
            self.kept,
        )
