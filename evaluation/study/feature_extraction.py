"""Feature extraction: maps, places and queries of a drive, in one pass."""

from collections.abc import Callable, Mapping, Set
import contextlib
from dataclasses import dataclass, field
import math
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.lib.recfunctions import repack_fields

from cns_drake.base.errors import InputError
from cns_drake.base.jobs.step import Reporter, Step
from cns_drake.base.points import xyz
from cns_drake.base.progress import doing, track
from evaluation.change.drive_maps import DriveMap
from evaluation.drives import Drive, DriveNames
from evaluation.drives.drive_views import RecentScans
from evaluation.drives.sampling import cropped, sample_frames, within_range
from evaluation.maps.thumbnails import thumbnail
from evaluation.maps.voxel_maps import (
    CELL_SIZE,
    VoxelAccumulator,
    VoxelMap,
    map_drive,
)
from evaluation.methods import MethodConfig
from evaluation.recognition import describing
from evaluation.recognition.descriptors import DriveDescriptors
from evaluation.recognition.protocol import FAIR_PROTOCOL, RetrievalProtocol
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.parts import Part
from evaluation.study.sources import DriveSource
from evaluation.study.study_files import FeatureFiles

# Divisions of a cell's side for pictures, with a point in each 0.5 m.
PICTURE_DIVISIONS = 2
# A method, and what it describes of a drive by a second protocol.
Further: TypeAlias = (
    "tuple[MethodChoice, frozenset[describing.Role], RetrievalProtocol]"
)
# Fields of the points of kept scans, where a drive has them.
_KEPT_FIELDS = ("x", "y", "z", "instance")


class MappedDrive(RecentScans):
    """A drive that makes a map of its scans while they are read.

    If scans are requested in nearly increasing order, each scan is read only
    once.
    """

    def __init__(self, drive: Drive, kept: int):
        super().__init__(drive, kept)
        self._accumulator = VoxelAccumulator(CELL_SIZE, PICTURE_DIVISIONS)
        self._num_mapped = 0

    def scan(self, index: int) -> np.ndarray:
        while self._num_mapped <= index:
            self._map_next()
        return super().scan(index)

    def finish(self) -> tuple[VoxelMap, np.ndarray]:
        """Reads the remaining scans, so that the map is complete.

        Returns:
            The map of all scans, in voxels of 1 m from which the change ratio
            (TCR) is computed; and a finer cloud (K, 3) for pictures, in W [m].
        """
        left = range(self._num_mapped, len(self))
        for _ in track(left, f"mapping {self.name}", len(left), "scans"):
            self._map_next()
        return self._accumulator.to_map(), self._accumulator.samples()

    def _map_next(self) -> None:
        scan = super().scan(self._num_mapped)
        self._accumulator.add(scan, self.X_WS[self._num_mapped])
        self._num_mapped += 1


@dataclass(frozen=True)
class DriveSummary:
    """A drive with its map, and with its scans reduced to small pictures.

    Attributes:
        placed: names of the drive, its world frame and its map.
        stamps_ns: (N,) int64 time stamps of all frames [ns].
        X_WS: (N, 4, 4) poses of the sensor at all frames.
        coarse: the map, in voxels of 1 m from which the change ratio (TCR) is
            computed.
        frames: (K,) frames that are places or queries; empty if the drive has
            neither.
        thumbnails: K reduced scans at these frames, see
            `evaluation.maps.thumbnails`.
    """

    placed: DriveNames
    stamps_ns: np.ndarray
    X_WS: np.ndarray
    coarse: VoxelMap
    frames: np.ndarray
    thumbnails: list[np.ndarray]

    @property
    def name(self) -> str:
        return self.placed.name

    @property
    def positions(self) -> np.ndarray:
        """(N, 3) positions of the sensor in the world [m]."""
        return self.X_WS[:, :3, 3]

    @property
    def drive_map(self) -> DriveMap:
        """The map, with the names of the drive, its world and its map."""
        return DriveMap(self.name, self.coarse, self.positions, self.placed)


@dataclass(frozen=True)
class KeptScans:
    """A drive with only the scans of its places and queries.

    Attributes:
        name: name of the drive.
        X_WS: (N, 4, 4) poses of the sensor at all frames.
        instances: instance id of a structure -> its name and class; None if
            unknown.
        scans: frame -> structured array (M,) with coordinates and instance ids
            of the points within range.
    """

    name: str
    X_WS: np.ndarray
    instances: Mapping[int, Mapping] | None
    scans: dict[int, np.ndarray] = field(default_factory=dict)

    def __len__(self) -> int:
        """Returns the number of frames of the drive."""
        return len(self.X_WS)

    def keep(self, frame: int, scan: np.ndarray, max_range: float) -> None:
        """Stores a scan in `scans`.

        Args:
            frame: number of the frame.
            scan: structured array (M,) in the sensor's frame.
            max_range: limit of the coordinates in the frame of the rotated
                sensor [m]. A point is stored if some rotation of the sensor can
                bring all its coordinates within this limit.
        """
        # A corner of the cube may lie on an axis of a rotated sensor.
        max_range *= math.sqrt(3.0)
        names = [one for one in scan.dtype.names or () if one in _KEPT_FIELDS]
        kept = within_range(xyz(scan), max_range)
        # A view would hold all fields.
        self.scans[frame] = repack_fields(scan[names][kept])

    def scan(self, index: int) -> np.ndarray:
        """Returns the scan of a frame, which must have been kept."""
        return self.scans[index]


@dataclass(frozen=True)
class ExtractedFeatures:
    """The results of reading a recording once: map, places and queries.

    Attributes:
        placed: names of the drive, its world frame and its map.
        described: key of a method -> its descriptors of the places and
            queries; empty if the drive has neither.
        scans: scans of places and queries; None if they are not kept. If there
            is a map, this is a `KeptScans` with the recorded scans. Otherwise
            it is a list of arrays (N, 3) float32, in which queries are changed
            as the protocol says: rotated, tilted or without a sector.
        drive: the drive with its map; None without a map.
        fine: (K, 3) cloud for pictures in W [m]; None without a map.
    """

    placed: DriveNames
    described: dict[str, DriveDescriptors]
    scans: KeptScans | list[np.ndarray] | None
    drive: DriveSummary | None = None
    fine: np.ndarray | None = None


def described_key(method: str, protocol: RetrievalProtocol) -> str:
    """Returns the key in `ExtractedFeatures.described` for a second protocol.

    Descriptors by the study's own protocol have the key of the method. Use this
    function for descriptors by any other protocol.

    Args:
        method: key of the method.
        protocol: the second protocol, such as that of published results.
    """
    return f"{method},{protocol.name}"


def extract_features(
    recording: Drive,
    roles: Set[describing.Role],
    asked: Mapping[str, describing.Request],
    protocol: RetrievalProtocol = FAIR_PROTOCOL,
    *,
    with_scans: bool = False,
) -> ExtractedFeatures:
    """Maps a recording and describes its places and queries.

    Each scan is read once, in order.

    Args:
        recording: the drive.
        roles: whether the drive has places of the database, queries, or both;
            the set may be empty.
        asked: key of each set of descriptors to compute -> method, roles and
            protocol; empty if the drive has neither places nor queries.
        protocol: protocol that chooses the frames whose scans are shown as
            thumbnails and, if `with_scans` is set, kept.
        with_scans: whether the result contains the scans of the places and
            queries.

    Raises:
        InputError: if the recording cannot be read, or contains no points.
    """
    frames: list[int] = []
    thumbnails = []
    mapped = MappedDrive(recording, _most_scans(asked))
    kept: KeptScans | None = None
    if with_scans:
        known = recording.instances
        kept = KeptScans(mapped.name, mapped.X_WS, known and dict(known))

    def keep(frame: int, cloud: np.ndarray) -> None:
        # Pictures show the scan as recorded, whatever its query sees.
        frames.append(frame)
        scan = mapped.scan(frame)
        if kept is not None:
            kept.keep(frame, scan, protocol.max_range)
        height = MethodConfig().sensor_height
        shown = cropped(scan, protocol.max_range)
        thumbnails.append(thumbnail(shown, height, seed=frame))

    described = {}
    if roles:
        described = _described(mapped, roles, asked, protocol, keep)
    coarse, fine = mapped.finish()
    if len(coarse) == 0:
        raise InputError(f"{mapped.name}: no scan holds a point")
    placed = DriveNames.of(recording)
    summary = DriveSummary(
        placed=placed,
        stamps_ns=mapped.stamps_ns,
        X_WS=mapped.X_WS,
        coarse=coarse,
        frames=np.array(frames, dtype=np.int64),
        thumbnails=thumbnails,
    )
    return ExtractedFeatures(placed, described, kept, summary, fine)


def map_source(
    reporter: Reporter, source: DriveSource, spacing: float | None
) -> DriveMap:
    """Returns the voxel map of a drive, to compute the change ratio (TCR).

    Args:
        reporter: reports progress.
        source: function that opens the drive.
        spacing: distance along the path between two scans in the map [m]; None
            for all scans.
    """
    drive = source()
    positions = drive.X_WS[:, :3, 3]
    frames = None
    if spacing is not None:
        frames = sample_frames(positions, spacing).tolist()
    voxels = map_drive(drive, CELL_SIZE, frames)
    return DriveMap(drive.name, voxels, positions)


def describe_recording(
    recording: Drive,
    roles: Set[describing.Role],
    asked: Mapping[str, describing.Request],
    protocol: RetrievalProtocol = FAIR_PROTOCOL,
) -> ExtractedFeatures:
    """Describes the places or queries of a recording, and keeps their scans.

    No map is made. Only the scans of places and queries are read, each once.
    The arguments are those of `extract_features`.
    """
    drive = RecentScans(recording, _most_scans(asked))
    seen: list[np.ndarray] = []

    def keep(frame: int, cloud: np.ndarray) -> None:
        seen.append(cloud.astype(np.float32))

    described = _described(drive, roles, asked, protocol, keep)
    return ExtractedFeatures(DriveNames.of(recording), described, seen)


def _most_scans(asked: Mapping[str, describing.Request]) -> int:
    """Returns the greatest number of scans that a method merges."""
    return max((p.scans(method) for method, _, p in asked.values()), default=1)


def _described(
    drive: Drive,
    roles: Set[describing.Role],
    asked: Mapping[str, describing.Request],
    protocol: RetrievalProtocol,
    visit: Callable[[int, np.ndarray], None],
) -> dict[str, DriveDescriptors]:
    found = describing.describe_drive(
        drive, (), roles, protocol, visit, asked.values()
    )
    return dict(zip(asked, found, strict=True))


@dataclass(frozen=True)
class FeatureExtraction(Step):
    """A job step that reads a drive once and writes the files that are missing.

    The files contain the drive's map and descriptors of its places and
    queries.

    Attributes:
        source: opens the drive.
        roles: whether the drive has places, queries, both or neither.
        methods: methods that describe the places and queries.
        protocol: protocol by which places and queries are chosen.
        files: the files to write.
        with_scans: whether to keep the scans of places and queries.
        with_map: whether to make a map; otherwise only the scans of places and
            queries are read.
        further: methods with descriptors by a second protocol, if any.
        removes_descriptors: whether descriptors are removed when results have
            been made from them. Descriptors that new results need are computed
            again.
    """

    source: DriveSource
    roles: frozenset[describing.Role]
    methods: tuple[MethodChoice, ...]
    protocol: RetrievalProtocol
    files: FeatureFiles
    with_scans: bool = False
    with_map: bool = True
    further: tuple[Further, ...] = ()
    removes_descriptors: bool = False

    @property
    def output(self) -> Path:
        return self.files.folder

    def is_done(self) -> bool:
        # A drive that is new is not read for this.
        asked = map(self.files.described, self._asked)
        return all(one.path.is_file() for one in asked) and not self._missing()

    def missing(self) -> list[Part]:
        """Returns the files of an earlier run that are missing or stale.

        The result is empty if there is no recording yet, or no earlier run.
        """
        with contextlib.suppress(InputError):
            if self.files.folder.is_dir():
                return list(self._missing())
        return []

    def run(self, reporter: Reporter) -> None:
        missing = self._missing()
        asked = {
            key: (choice.make(), roles, protocol)
            for key, (choice, roles, protocol) in self._asked.items()
            if self.files.described(key) in missing
        }
        arguments = (
            self.source(),
            self.roles,
            asked,
            self.protocol,
        )
        if self.with_map:
            found = extract_features(*arguments, with_scans=self.with_scans)
        else:
            found = describe_recording(*arguments)
        values: dict[Part, object] = {
            self.files.scans: found.scans,
            self.files.fine: found.fine,
            self.files.drive: found.drive,
        }
        for key, described in found.described.items():
            values[self.files.described(key)] = found.placed, described
        doing("writing maps and descriptors")
        for part, made_of in missing.items():
            part.write(made_of, values[part])

    @property
    def _asked(self) -> dict[str, Further]:
        """Name of each descriptor -> method, roles and protocol."""
        asked = {
            one.key: (one, self.roles, self.protocol) for one in self.methods
        }
        for choice, roles, protocol in self.further:
            key = described_key(choice.key, protocol)
            asked[key] = choice, roles, protocol
        return asked if self.roles else {}

    def _missing(self) -> dict[Part, Mapping]:
        """Returns the parts that are missing or stale, and their inputs."""
        drive = self.source.identity()

        def inputs(
            roles: Set[describing.Role], protocol: RetrievalProtocol
        ) -> dict[str, object]:
            options = protocol.descriptor_options(queries="queries" in roles)
            return self.made_of(
                {
                    "drive": drive,
                    "roles": sorted(roles),
                    "protocol": options if roles else None,
                    "with_map": self.with_map,
                }
            )

        own = inputs(self.roles, self.protocol)
        expected: dict[Part, Mapping] = {
            self.files.described(key): {
                **inputs(roles, protocol),
                "method": choice.identity(),
            }
            for key, (choice, roles, protocol) in self._asked.items()
        }
        if self.with_scans:
            expected[self.files.scans] = own
        if self.with_map:
            expected |= dict.fromkeys([self.files.fine, self.files.drive], own)
        return {
            part: made_of
            for part, made_of in expected.items()
            if not part.is_current(made_of)
        }
