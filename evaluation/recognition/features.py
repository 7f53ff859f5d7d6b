"""What is read of a drive, once: its map, its descriptors and its scans."""

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import partial
import math
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.lib.recfunctions import repack_fields

from evaluation.base import (
    InputError,
    LongList,
    Part,
    Reporter,
    Step,
    doing,
    file_name,
    fingerprint,
    make_folder,
    xyz,
)
from evaluation.drives import (
    Drive,
    DriveSource,
    RecentScans,
    cropped,
    within_cube,
)
from evaluation.maps import MappedDrive, VoxelMap, thumbnail
from evaluation.methods import MethodConfig
from evaluation.recognition.chosen_methods import MethodChoice
from evaluation.recognition.describing import (
    DescribingCost,
    Request,
    Role,
    describe_drive,
)
from evaluation.recognition.descriptors import DriveDescriptors
from evaluation.recognition.protocol import (
    RANDOM_YAW_PROTOCOL,
    RetrievalProtocol,
)

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
        costs: key -> what these descriptors have taken.
    """

    described: dict[str, DriveDescriptors]
    costs: dict[str, DescribingCost]


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


# A method, and what it describes of a drive by a second protocol.
Further: TypeAlias = "tuple[MethodChoice, frozenset[Role], RetrievalProtocol]"


def extract_features(
    recording: Drive,
    roles: Set[Role],
    asked: Mapping[str, Request],
    protocol: RetrievalProtocol = RANDOM_YAW_PROTOCOL,
    *,
    with_scans: bool = False,
    folder: Path | None = None,
) -> MappedFeatures:
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
        folder: existing folder for temporary files of long drives; None for the
            system's folder.

    Raises:
        InputError: if the recording cannot be read, or contains no points.
    """
    frames: list[int] = []
    thumbnails = []
    mapped = MappedDrive(recording, _most_scans(asked))
    kept = LongList(folder)

    def keep(frame: int, cloud: np.ndarray) -> None:
        # Pictures show the scan as recorded, whatever its query sees.
        frames.append(frame)
        scan = mapped.scan(frame)
        if with_scans:
            kept.append(kept_points(scan, protocol.half_extent))
        height = MethodConfig().sensor_height
        shown = cropped(scan, protocol.half_extent)
        thumbnails.append(thumbnail(shown, height, seed=frame))

    described: dict[str, DriveDescriptors] = {}
    costs: dict[str, DescribingCost] = {}
    if roles:
        described, costs = _described(
            mapped, roles, asked, protocol, keep, folder
        )
    coarse, fine = mapped.finish()
    if len(coarse) == 0:
        raise InputError(f"{mapped.name}: no scan holds a point")
    summary = DriveSummary(
        name=mapped.name,
        stamps_ns=mapped.stamps_ns,
        X_WS=mapped.X_WS,
        coarse=coarse,
        frames=np.array(frames, dtype=np.int64),
        thumbnails=thumbnails,
    )
    scans = None
    if with_scans:
        known = recording.instances
        scans = KeptScans(
            mapped.name,
            mapped.X_WS,
            known and dict(known),
            np.array(frames, np.int64),
            kept,
        )
    return MappedFeatures(described, costs, summary, fine, scans)


def describe_recording(
    recording: Drive,
    roles: Set[Role],
    asked: Mapping[str, Request],
    protocol: RetrievalProtocol = RANDOM_YAW_PROTOCOL,
    *,
    folder: Path | None = None,
) -> ScannedFeatures:
    """Describes the places or queries of a recording, and keeps their scans.

    No map is made. Only the scans of places and queries are read, each once.
    The arguments are the same as for `extract_features`.
    """
    drive = RecentScans(recording, _most_scans(asked))
    seen = LongList(folder)

    def keep(frame: int, cloud: np.ndarray) -> None:
        seen.append(cloud.astype(np.float32))

    found = _described(drive, roles, asked, protocol, keep, folder)
    return ScannedFeatures(*found, seen)


def _most_scans(asked: Mapping[str, Request]) -> int:
    """Returns the greatest number of scans that a method merges."""
    return max((p.scans(method) for method, _, p in asked.values()), default=1)


def _described(
    drive: Drive,
    roles: Set[Role],
    asked: Mapping[str, Request],
    protocol: RetrievalProtocol,
    visit: Callable[[int, np.ndarray], None],
    folder: Path | None,
) -> tuple[dict[str, DriveDescriptors], dict[str, DescribingCost]]:
    costs: list[DescribingCost] = []
    found = describe_drive(
        drive,
        (),
        roles,
        protocol,
        visit,
        asked.values(),
        partial(LongList, folder),
        costs,
    )
    return (
        dict(zip(asked, found, strict=True)),
        dict(zip(asked, costs, strict=True)),
    )


@dataclass(frozen=True)
class FeatureFiles:
    """The files (`Part`) with all that is needed of a recording.

    The files contain the drive's poses and map, the scans at places and
    queries, and, in one file for each method, the descriptors of these scans.

    Attributes:
        folder: folder of the files.
    """

    folder: Path

    @property
    def drive(self) -> Part:
        """The file with the drive's poses and map, a `DriveSummary`."""
        return Part(self.folder / "drive.data")

    @property
    def fine(self) -> Part:
        """The file with the cloud for pictures, an array (K, 3)."""
        return Part(self.folder / "fine.data")

    @property
    def scans(self) -> Part:
        """The file with the drive's scans at places and queries.

        For a drive with a map, the file contains a `KeptScans`; otherwise a
        list of scans (N, 3).
        """
        return Part(self.folder / "scans.data")

    def described(self, key: str) -> Part:
        """Returns the file with a method's descriptors of the drive.

        The file contains a `DriveDescriptors`.

        Args:
            key: `MethodChoice.key` of the method; for descriptors by a second
                protocol, the result of `described_key`.
        """
        return Part(self.folder / f"described_{file_name(key)}.data")

    def cost(self, key: str) -> Part:
        """Returns the file with the `DescribingCost` of these descriptors."""
        return Part(self.folder / f"cost_{file_name(key)}.data")


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
    """

    source: DriveSource
    roles: frozenset[Role]
    methods: tuple[MethodChoice, ...]
    protocol: RetrievalProtocol
    files: FeatureFiles
    with_scans: bool = False
    with_map: bool = True
    further: tuple[Further, ...] = ()

    @property
    def output(self) -> Path:
        return self.files.folder

    def is_done(self) -> bool:
        # A drive that is new is not read for this.
        asked = map(self.files.described, self._asked)
        return all(one.path.is_file() for one in asked) and not self._missing()

    def run(self, reporter: Reporter) -> None:
        missing = self._missing()
        asked = {
            key: (choice.make(), roles, protocol)
            for key, (choice, roles, protocol) in self._asked.items()
            if missing.keys()
            & {self.files.described(key), self.files.cost(key)}
        }
        arguments = (
            self.source(),
            self.roles,
            asked,
            self.protocol,
        )
        found: MappedFeatures | ScannedFeatures
        values: dict[Part, object]
        folder = self.files.folder
        make_folder(folder)
        if self.with_map:
            found = extract_features(
                *arguments, with_scans=self.with_scans, folder=folder
            )
            values = {
                self.files.scans: found.recorded_scans,
                self.files.fine: found.fine,
                self.files.drive: found.drive,
            }
        else:
            found = describe_recording(*arguments, folder=folder)
            values = {self.files.scans: found.shown_scans}
        for key, described in found.described.items():
            values[self.files.described(key)] = described
            values[self.files.cost(key)] = found.costs[key]
        doing("writing maps and descriptors")
        for part, made_of in missing.items():
            part.write(made_of, values[part])

    @property
    def _asked(self) -> dict[str, Further]:
        """Method, roles and protocol of each descriptor, by its name."""
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
            roles: Set[Role], protocol: RetrievalProtocol
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
        expected: dict[Part, Mapping] = {}
        for key, (choice, roles, protocol) in self._asked.items():
            parts = self.files.described(key), self.files.cost(key)
            made_of = inputs(roles, protocol) | {"method": choice.identity()}
            expected |= dict.fromkeys(parts, made_of)
        if self.with_scans:
            expected[self.files.scans] = own
        if self.with_map:
            expected |= dict.fromkeys([self.files.fine, self.files.drive], own)
        return {
            part: made_of
            for part, made_of in expected.items()
            if not part.is_current(made_of)
        }
