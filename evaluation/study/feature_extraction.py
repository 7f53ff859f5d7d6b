"""Feature extraction: reads a drive once, for its map and descriptors."""

from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np

from cns_drake.base import InputError, Reporter, Step, doing, make_folder
from cns_drake.drives import Drive
from evaluation.change import DriveMap
from evaluation.drives import RecentScans, cropped, sample_frames
from evaluation.maps import CELL_SIZE, MappedDrive, map_drive, thumbnail
from evaluation.methods import MethodConfig
from evaluation.recognition import (
    RANDOM_YAW_PROTOCOL,
    DriveDescriptors,
    Request,
    RetrievalProtocol,
    Role,
    describe_drive,
)
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.features import (
    DriveSummary,
    KeptScans,
    MappedFeatures,
    ScannedFeatures,
    described_key,
    kept_points,
)
from evaluation.study.parts import LongList, Part
from evaluation.study.sources import DriveSource
from evaluation.study.study_files import FeatureFiles

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

    described = {}
    if roles:
        described = _described(mapped, roles, asked, protocol, keep, folder)
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
    return MappedFeatures(described, summary, fine, scans)


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

    described = _described(drive, roles, asked, protocol, keep, folder)
    return ScannedFeatures(described, seen)


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
) -> dict[str, DriveDescriptors]:
    found = describe_drive(
        drive,
        (),
        roles,
        protocol,
        visit,
        asked.values(),
        partial(LongList, folder),
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
            if self.files.described(key) in missing
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
