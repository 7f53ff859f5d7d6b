"""Descriptions of a drive's places and queries, by methods."""

from collections.abc import Callable, Iterable, Mapping, Set
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np

from cns_drake.base.drives.drive import Drive
from cns_drake.base.errors import InputError
from cns_drake.base.progress import Track, silent
from evaluation.drives.sampling import gather, sample_frames
from evaluation.methods.method import Method
from evaluation.recognition.protocol import DEFAULT_PROTOCOL, RetrievalProtocol

# The role of a drive.
Role = Literal["places", "queries"]
# A frame, with its cloud in each role that it has.
_Waiting: TypeAlias = "tuple[int, Mapping[Role, np.ndarray]]"


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
    protocol: RetrievalProtocol = DEFAULT_PROTOCOL,
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
            cropped, in the frame of the sensor: as recorded if the drive has
            places, else as its queries see it.

    Returns:
        The descriptions by each method.

    Raises:
        InputError: if the drive cannot be read, it lacks a field that a
            method needs, or no described cloud has a point within range.
    """
    describing = [_Describing(method, drive, protocol) for method in methods]
    frames = {role: _frames(drive, role, protocol) for role in roles}
    wanted = np.unique(np.concatenate([*frames.values()])).tolist()
    # Number of merged scans of a cloud, of those before its frame, and fields
    # of its points.
    kinds = {one.kind for one in describing}
    single: tuple[int, int, tuple[str, ...]] = (1, 0, ())
    if visit is not None:
        kinds.add(single)
    num_points = 0
    members = {role: set(found.tolist()) for role, found in frames.items()}
    for frame in track(wanted, f"describing {drive.name}", len(wanted)):
        sensors = {
            role: protocol.query_sensor(frame) if role == "queries" else None
            for role in sorted(roles)
            if frame in members[role]
        }
        shown = None if "places" in roles else sensors["queries"]
        needed = dict.fromkeys(sensors.values())
        if visit is not None:
            needed[shown] = None
        clouds = {
            (sensor, kind): gather(
                drive,
                frame,
                kind[0],
                protocol.max_range,
                kind[2],
                kind[1],
                sensor,
            )
            for sensor in needed
            for kind in kinds
        }
        num_points += max(map(len, clouds.values()))
        if visit is not None:
            visit(frame, clouds[shown, single])
        for one in describing:
            one.add(frame, {r: clouds[s, one.kind] for r, s in sensors.items()})
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
        protocol: RetrievalProtocol,
    ):
        self.kind = (
            protocol.scans(method),
            protocol.scans_before(method),
            tuple(method.point_fields),
        )
        self._method = method
        self._waiting: list[_Waiting] = []
        scans = {}
        for role in ("places", "queries"):
            frames = _frames(drive, role, protocol)
            X_WS = drive.X_WS[frames]
            if role == "queries":
                X_WS = protocol.query_poses(X_WS, frames)
            scans[role] = DescribedScans(frames, drive.stamps_ns[frames], X_WS)
        self._drive = DescribedDrive(drive.name, **scans)

    def add(self, frame: int, clouds: Mapping[Role, np.ndarray]) -> None:
        self._waiting.append((frame, clouds))
        if len(self._waiting) >= self._method.batch_size:
            self._flush()

    def finish(self) -> DescribedDrive:
        self._flush()
        return self._drive

    def _flush(self) -> None:
        waiting, self._waiting = self._waiting, []
        places = self._describe(waiting, "places")
        self._keep(self._drive.places, "places", places, waiting)
        shared = {}
        if self._method.describes_alike:
            shared = {
                frame: places[frame]
                for frame, clouds in waiting
                if frame in places and clouds.get("queries") is clouds["places"]
            }
        asked = [one for one in waiting if one[0] not in shared]
        queries = shared | self._describe(asked, "queries")
        self._keep(self._drive.queries, "queries", queries, waiting)

    def _describe(
        self, waiting: list[_Waiting], role: Role
    ) -> dict[int, object]:
        """Returns frame -> descriptor of the frames that have a role."""
        chosen = [
            (frame, clouds[role]) for frame, clouds in waiting if role in clouds
        ]
        if not chosen:
            return {}
        found = self._method.describe_batch(
            [cloud for _, cloud in chosen], of_places=role == "places"
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
        role: Role,
        described: dict[int, object],
        waiting: list[_Waiting],
    ) -> None:
        for frame, clouds in waiting:
            if frame in described:
                scans.descriptors.append(described[frame])
                if self._method.rerank_best:
                    scans.clouds.append(clouds[role])
