"""The parts of a report that come from one recording, found in one pass."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.base.progress import Track, silent
from evaluation.drives import Drive, PlacedDrive
from evaluation.maps.mapped_drive import MappedDrive
from evaluation.maps.thumbnails import thumbnail
from evaluation.maps.voxel_maps import VoxelMap
from evaluation.methods import Method, MethodConfig
from evaluation.recognition.description import (
    DescribedDrive,
    Role,
    describe_drive,
)
from evaluation.recognition.protocol import (
    PAPER_PROTOCOL,
    RetrievalProtocol,
)


@dataclass(frozen=True)
class SurveyedDrive:
    """A drive with its map on the grid of the TCR.

    Attributes:
        placed: name and world of the drive.
        stamps_ns: (N,) int64 of its frames.
        X_WS: (N, 4, 4) poses of the sensor along the drive.
        coarse: the map.
        frames: (K,) frames that are places or queries, increasing; none if
            the drive has no role.
        thumbnails: K reduced scans (see `evaluation.maps.thumbnails`).
    """

    placed: PlacedDrive
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
        """(N, 3) of the sensor [m]."""
        return self.X_WS[:, :3, 3]


@dataclass(frozen=True)
class RecordingSurvey:
    """A recording's maps, places and queries, which replace its scans.

    Attributes:
        drive: with its map on the grid of the TCR.
        fine: (K, 3) cloud for pictures, in W [m].
        described: method -> its descriptions of the drive; empty if the
            recording has no role.
    """

    drive: SurveyedDrive
    fine: np.ndarray
    described: dict[str, DescribedDrive]


def survey_recording(
    recording: Drive,
    roles: Set[Role],
    methods: Sequence[Method],
    protocol: RetrievalProtocol = PAPER_PROTOCOL,
    track: Track = silent,
) -> RecordingSurvey:
    """Maps a recording and describes its places and queries.

    Each scan is read once, in order.

    Args:
        recording: the drive.
        roles: of the drive in place recognition; may be empty.
        methods: that describe it; may be none.
        protocol: sets the places and queries.
        track: reports progress.

    Raises:
        InputError: if it cannot be read, or holds no point.
    """
    frames, thumbnails = [], []
    mapped = MappedDrive(
        recording,
        kept=max(map(protocol.scans, methods), default=1),
    )

    def keep_thumbnail(frame: int, cloud: np.ndarray) -> None:
        frames.append(frame)
        height = MethodConfig().sensor_height
        thumbnails.append(thumbnail(cloud, height, seed=frame))

    described = {}
    if roles:
        drives = describe_drive(
            mapped, methods, roles, protocol, track, visit=keep_thumbnail
        )
        described = {
            method.name: drive
            for method, drive in zip(methods, drives, strict=True)
        }
    coarse, fine = mapped.finish(track)
    if len(coarse) == 0:
        raise InputError(f"{mapped.name}: no scan holds a point")
    drive = SurveyedDrive(
        placed=PlacedDrive.of(recording),
        stamps_ns=mapped.stamps_ns,
        X_WS=mapped.X_WS,
        coarse=coarse,
        frames=np.array(frames, dtype=np.int64),
        thumbnails=thumbnails,
    )
    return RecordingSurvey(drive, fine, described)
