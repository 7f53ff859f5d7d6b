"""A method's descriptors of the places and queries of drives."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

# Distance put between the worlds of joined scans [m].
_APART = 1e5


@dataclass(frozen=True)
class DescribedScans:
    """Places or queries of a drive, with a method's descriptors.

    Attributes:
        frames: (K,) frame numbers in the drive.
        stamps_ns: (K,) int64 time stamps.
        X_WS: (K, 4, 4) poses of the sensor.
        descriptors: K descriptors; empty if the scans have not been described.
        clouds: the K described clouds if the method has a second stage;
            otherwise empty.
        blocks: (K,) block of the route in which each place or query lies, see
            `evaluation.recognition.sign_flips.route_blocks`; None if the route
            is unknown.
        drive_of: (K,) number of the drive of each place, if the places are of
            several drives; None for one drive.
    """

    frames: np.ndarray
    stamps_ns: np.ndarray
    X_WS: np.ndarray
    descriptors: Sequence[Any] = field(default_factory=list)
    clouds: Sequence[np.ndarray] = field(default_factory=list)
    blocks: np.ndarray | None = None
    drive_of: np.ndarray | None = None

    @property
    def positions_only(self) -> DescribedScans:
        """The places or queries without descriptors and clouds."""
        return replace(self, descriptors=[], clouds=[])

    @property
    def p_WSs(self) -> np.ndarray:
        """(K, 3) positions of the sensor [m]."""
        return self.X_WS[:, :3, 3]

    def chosen(self, rows: np.ndarray) -> DescribedScans:
        """Returns some of the places or queries, by their indices (J,)."""
        blocks, drive_of = (
            None if column is None else column[rows]
            for column in (self.blocks, self.drive_of)
        )
        return DescribedScans(
            self.frames[rows],
            self.stamps_ns[rows],
            self.X_WS[rows],
            [self.descriptors[row] for row in rows] if self.descriptors else [],
            [self.clouds[row] for row in rows] if self.clouds else [],
            blocks,
            drive_of,
        )


def joined_scans(
    every: Sequence[DescribedScans],
    worlds: Iterable[int],
    most: int | None = None,
) -> DescribedScans:
    """Returns the places or queries of several drives as one list.

    Args:
        every: scans of each drive, with a method's descriptors.
        worlds: number of the world of each drive. Different worlds are moved so
            far apart that their scans never match.
        most: number of scans to keep, from the start of the list; None for all.
    """
    poses = []
    is_one = len(every) == 1 and every[0].drive_of is None
    drives: list[np.ndarray] = []
    for scans, world in zip(every, worlds, strict=True):
        own = scans.drive_of
        if own is None:
            own = np.zeros(len(scans.frames), np.int64)
        before = max((int(d.max(initial=-1)) for d in drives), default=-1)
        drives.append(own + before + 1)
        X_WS = scans.X_WS.copy()
        X_WS[:, 0, 3] += world * _APART
        poses.append(X_WS)
    return DescribedScans(
        frames=np.concatenate([scans.frames for scans in every])[:most],
        stamps_ns=np.concatenate([scans.stamps_ns for scans in every])[:most],
        X_WS=np.concatenate(poses)[:most],
        descriptors=[d for scans in every for d in scans.descriptors][:most],
        clouds=[cloud for scans in every for cloud in scans.clouds][:most],
        drive_of=None if is_one else np.concatenate(drives)[:most],
    )


@dataclass(frozen=True)
class DriveDescriptors:
    """A method's descriptors of a drive.

    Attributes:
        name: name of the drive.
        places: places of the drive, among which queries are searched.
        queries: queries of the drive.
    """

    name: str
    places: DescribedScans
    queries: DescribedScans
