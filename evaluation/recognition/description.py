"""Descriptions of a drive's places and queries, by methods."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Set
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from cns_drake.base.drives.drive import Drive
from cns_drake.base.errors import InputError
from cns_drake.base.progress import Track, silent
from evaluation.drives.sampling import gather, sample_frames
from evaluation.methods.method import Method
from evaluation.recognition.protocol import PAPER_PROTOCOL, RetrievalProtocol

# The role of a drive.
Role = Literal["places", "queries"]


@dataclass(frozen=True)
class DescribedScans:
    """Places or queries of a drive, with a method's descriptions.

    Attributes:
        frames: (K,) of the drive.
        stamps_ns: (K,) int64.
        X_WS: (K, 4, 4) poses of the sensor.
        descriptors: K descriptors; none if the drive does not have this role.
        clouds: the K described clouds, for methods with a second stage; else
            none.
    """

    frames: np.ndarray
    stamps_ns: np.ndarray
    X_WS: np.ndarray
    descriptors: list = field(default_factory=list)
    clouds: list[np.ndarray] = field(default_factory=list)

    @property
    def p_WSs(self) -> np.ndarray:
        """(K, 3) positions of the sensor [m]."""
        return self.X_WS[:, :3, 3]


@dataclass(frozen=True)
class DescribedDrive:
    """A method's descriptions of a drive.

    Attributes:
        name: name of the drive.
        places: for queries to find.
        queries: queries of the drive.
    """

    name: str
    places: DescribedScans
    queries: DescribedScans


def describe_drive(
    drive: Drive,
    methods: Iterable[Method],
    roles: Set[Role],
    protocol: RetrievalProtocol = PAPER_PROTOCOL,
    track: Track = silent,
    visit: Callable[[int, np.ndarray], None] | None = None,
) -> list[DescribedDrive]:
    """Describes the places and queries of a drive, each cloud once.

    If a frame is both a place and a query, a method that describes both alike
    describes it once. Clouds are shared between methods.

    Args:
        drive: the drive.
        methods: to run.
        roles: roles of the drive.
        protocol: for the frames of places and queries, and their clouds.
        track: reports progress.
        visit: also receives each described frame and its single scan (N, 3),
            cropped, in the frame of the sensor.

    Returns:
        The descriptions by each method.

    Raises:
        InputError: if the drive cannot be read, it lacks a field that a
            method needs, or no described cloud has a point within range.
    """
    describing = [
        _Describing(method, drive, roles, protocol) for method in methods
    ]
    frames = {role: _frames(drive, role, protocol) for role in roles}
    wanted = np.unique(np.concatenate([*frames.values()])).tolist()
    # Number of merged scans of a cloud, of those before its frame, and fields
    # of its points.
    kinds = {one.kind for one in describing}
    single: tuple[int, int, tuple[str, ...]] = (1, 0, ())
    if visit is not None:
        kinds.add(single)
    num_points = 0
    for frame in track(wanted, f"describing {drive.name}", len(wanted)):
        clouds = {
            (number, before, fields): gather(
                drive, frame, number, protocol.max_range, fields, before
            )
            for number, before, fields in kinds
        }
        num_points += max(map(len, clouds.values()))
        if visit is not None:
            visit(frame, clouds[single])
        for one in describing:
            one.add(frame, clouds[one.kind])
    if num_points == 0:
        raise InputError(
            f"{drive.name}: no finite point within {protocol.max_range:g} m"
            f" of the LiDAR in any of {len(wanted)} scans"
        )
    return [one.finish() for one in describing]


def _frames(
    drive: Drive, role: Role, protocol: RetrievalProtocol
) -> np.ndarray:
    spacing = protocol.place_spacing
    if role == "queries":
        spacing = protocol.query_spacing
    return sample_frames(drive.X_WS[:, :3, 3], spacing)


class _Describing:
    """The descriptions of one drive by one method, in progress."""

    def __init__(
        self,
        method: Method,
        drive: Drive,
        roles: Set[Role],
        protocol: RetrievalProtocol,
    ):
        self.kind = (
            protocol.scans(method),
            protocol.scans_before(method),
            tuple(method.point_fields),
        )
        self._method = method
        self._waiting: list[tuple[int, np.ndarray]] = []
        scans = {}
        for role in ("places", "queries"):
            frames = _frames(drive, role, protocol)
            scans[role] = DescribedScans(
                frames, drive.stamps_ns[frames], drive.X_WS[frames]
            )
        self._drive = DescribedDrive(drive.name, **scans)
        self._members = {
            role: set(scans[role].frames.tolist()) if role in roles else set()
            for role in scans
        }

    def add(self, frame: int, cloud: np.ndarray) -> None:
        self._waiting.append((frame, cloud))
        if len(self._waiting) >= self._method.batch_size:
            self._flush()

    def finish(self) -> DescribedDrive:
        self._flush()
        return self._drive

    def _flush(self) -> None:
        waiting, self._waiting = self._waiting, []
        described = self._describe(waiting, self._members["places"], True)
        self._keep(self._drive.places, described, waiting)
        query_frames = self._members["queries"]
        shared = described if self._method.describes_alike else {}
        described = shared | self._describe(
            waiting, query_frames - set(shared), False
        )
        described = {
            f: one for f, one in described.items() if f in query_frames
        }
        self._keep(self._drive.queries, described, waiting)

    def _describe(
        self,
        waiting: list[tuple[int, np.ndarray]],
        members: set[int],
        of_places: bool,
    ) -> dict[int, object]:
        """Returns frame -> descriptor of the frames that are members."""
        chosen = [
            (frame, cloud) for frame, cloud in waiting if frame in members
        ]
        if not chosen:
            return {}
        found = self._method.describe_batch(
            [cloud for _, cloud in chosen], of_places=of_places
        )
        if len(found) != len(chosen):
            raise InputError(
                f"{self._method.name}: describe_batch returned {len(found)}"
                f" descriptors of {len(chosen)} clouds"
            )
        return {
            frame: one for (frame, _), one in zip(chosen, found, strict=True)
        }

    def _keep(
        self,
        scans: DescribedScans,
        described: dict[int, object],
        waiting: list[tuple[int, np.ndarray]],
    ) -> None:
        for frame, cloud in waiting:
            if frame in described:
                scans.descriptors.append(described[frame])
                if self._method.rerank_best:
                    scans.clouds.append(cloud)
