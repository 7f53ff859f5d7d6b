"""Lets place-recognition methods describe a drive's places and queries."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Set
from dataclasses import dataclass
import time
from typing import Any, Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from evaluation.base import InputError, track
from evaluation.drives import Drive, QuerySensor, cloud_at, sample_frames
from evaluation.methods import Method, check_number
from evaluation.recognition.descriptors import DescribedScans, DriveDescriptors
from evaluation.recognition.protocol import RECORDED_PROTOCOL, RetrievalProtocol
from evaluation.recognition.sign_flips import route_blocks

# What a drive's scans are used for: places of the database, or queries.
Role = Literal["places", "queries"]
# A frame that waits to be described, with its cloud in each of its roles.
_Waiting: TypeAlias = "tuple[int, Mapping[Role, np.ndarray]]"
# A method, the roles in which it describes a drive, and the protocol.
Request: TypeAlias = "tuple[Method, Set[Role], RetrievalProtocol]"


@dataclass(frozen=True)
class DescribingCost:
    """What a method's descriptors of a drive have taken.

    Attributes:
        scans: number of scans that are merged into a cloud.
        points: mean number of points of a cloud.
        time: median CPU time to describe a cloud [s]. The first does not count,
            because it includes loading and compiling.
    """

    scans: int
    points: float
    time: float


class _CloudKind(NamedTuple):
    """How a cloud is made of a drive's scans.

    Attributes:
        num_before: how many of these come before the frame of the cloud.
        fields: names of the fields of the points, besides x, y and z.
    """

    num_scans: int
    num_before: int
    fields: tuple[str, ...]


def describe_drive(
    drive: Drive,
    methods: Iterable[Method],
    roles: Set[Role],
    protocol: RetrievalProtocol = RECORDED_PROTOCOL,
    further: Iterable[Request] = (),
    visit: Callable[[int], None] = lambda frame: None,
    visited: Iterable[int] = (),
    make_list: Callable[[], Any] = list,
    costs: list[DescribingCost] | None = None,
) -> list[DriveDescriptors]:
    """Describes the places and queries of a drive.

    Each cloud is made only once for all methods. A frame that is both a place
    and a query is described only once by a method that describes both in the
    same way, also if they are of different protocols.

    Args:
        drive: the drive.
        methods: methods that describe the scans.
        roles: whether the drive has places, queries or both.
        protocol: protocol that determines the frames of places and queries, and
            how their clouds are made.
        further: requests for further descriptors: each is a method, the roles
            to describe, and a protocol.
        visit: function that is called with each frame in `visited`, before the
            frame is described.
        visited: frames at which `visit` is called.
        make_list: function that returns an empty sequence with a method
            `append`, which holds the descriptors of one method in one role.
        costs: list to which the cost of each result is appended.

    Returns:
        One `DriveDescriptors` for each method, followed by one for each entry
        of `further`.

    Raises:
        InputError: if the drive cannot be read, it lacks a field that a method
            needs, or no described cloud has a point within range.
    """
    requests = [*((method, roles, protocol) for method in methods), *further]
    describing: list[_DriveDescriber] = []
    for request in requests:
        describing.append(
            _DriveDescriber(drive, *request, make_list, describing)
        )
    visited = {*visited}
    wanted = sorted(
        visited.union(*(describer.frames for describer in describing))
    )
    num_points = 0
    for frame in track(
        wanted, f"describing {drive.name}", len(wanted), "scans"
    ):
        if frame in visited:
            visit(frame)
        seen = _FrameClouds(drive, frame)
        for describer in describing:
            describer.add(seen)
        num_points += seen.most_points
    if describing and num_points == 0:
        reach = max(protocol.half_extent for *_, protocol in requests)
        raise InputError(
            f"{drive.name}: no finite point within {reach:g} m"
            f" of the LiDAR in any of {len(wanted)} scans"
        )
    found = [describer.finish() for describer in describing]
    if costs is not None:
        costs += [describer.cost for describer in describing]
    return found


class _FrameClouds:
    """The clouds of a frame, each gathered once."""

    def __init__(self, drive: Drive, frame: int):
        self.frame = frame
        self._drive = drive
        self._sensors: dict[RetrievalProtocol, QuerySensor | None] = {}
        self._clouds: dict[tuple, np.ndarray] = {}

    def sensor(self, protocol: RetrievalProtocol) -> QuerySensor | None:
        """Returns how a protocol changes the sensor of a query at this frame.

        The sensor can be rotated, tilted and partly occluded. The result is
        None if the sensor stays as recorded.
        """
        if protocol not in self._sensors:
            self._sensors[protocol] = protocol.query_sensor(self.frame)
        return self._sensors[protocol]

    def cloud(
        self, sensor: QuerySensor | None, kind: _CloudKind, half_extent: float
    ) -> np.ndarray:
        """Returns the point cloud (N, 3) at the frame, in the sensor's frame.

        With fields in addition to x, y and z, the cloud is a structured array
        (N,). A second call with equal arguments returns the same array.

        Args:
            sensor: sensor that replaces the recorded sensor in a query, rotated
                or with an occluded sector; None for the sensor as recorded.
            kind: how the cloud is made.
            half_extent: greatest absolute x, y and z of a point [m].
        """
        key = sensor, kind, half_extent
        if key not in self._clouds:
            self._clouds[key] = cloud_at(
                self._drive,
                self.frame,
                kind.num_scans,
                half_extent,
                kind.fields,
                kind.num_before,
                sensor,
            )
        return self._clouds[key]

    @property
    def most_points(self) -> int:
        """Number of points of the largest cloud so far; 0 without a cloud."""
        return max(map(len, self._clouds.values()), default=0)


def _frames_of_role(
    drive: Drive, role: Role, protocol: RetrievalProtocol
) -> np.ndarray:
    """Returns the frames (K,) of a drive's places or queries."""
    spacing = protocol.place_spacing
    if role == "queries":
        spacing = protocol.query_spacing
    return sample_frames(drive.X_WS[:, :3, 3], spacing)


class _DriveDescriber:
    """Collects the descriptors of one drive by one method."""

    def __init__(
        self,
        drive: Drive,
        method: Method,
        roles: Set[Role],
        protocol: RetrievalProtocol,
        make_list: Callable[[], Any],
        others: Iterable[_DriveDescriber] = (),
    ):
        """Describes nothing yet.

        Args:
            drive, method, roles, protocol, make_list: see `describe_drive`.
            others: describers of the same drive, to which each frame is added
                before it is added to this one.
        """
        self._cloud_kind = _CloudKind(
            protocol.scans(method),
            protocol.scans_before(method),
            tuple(method.point_fields),
        )
        self._method = method.for_lidar(drive.lidar_field)
        if not isinstance(self._method, Method):
            raise InputError(f"{method.name}: for_lidar returned no method")
        self._protocol = protocol
        self._waiting: list[_Waiting] = []
        self._members: dict[Role, set[int]] = {}
        # CPU time of a cloud for each batch [ns], and points of each cloud.
        self._spent_ns: list[float] = []
        self._num_points: list[int] = []
        scans = {}
        for role in get_args(Role):
            frames = _frames_of_role(drive, role, protocol)
            X_WS = drive.X_WS[frames]
            if role == "queries":
                X_WS = protocol.query_poses(X_WS, frames)
            scans[role] = DescribedScans(
                frames,
                drive.stamps_ns[frames],
                X_WS,
                make_list(),
                make_list(),
                blocks=route_blocks(drive.X_WS[:, :3, 3], frames),
            )
            if role in roles:
                self._members[role] = set(frames.tolist())
        self._drive = DriveDescriptors(drive.name, **scans)
        # A describer whose places are described as these queries would be.
        self._alike = next(filter(self._has_such_places, others), None)

    def _has_such_places(self, other: _DriveDescriber) -> bool:
        """Returns whether this method describes queries as the other places.

        Queries with another sensor than the recorded one do not count. Of a
        method with batches, the bits may depend on the other clouds of a batch.
        """
        one, same = self._method, other._method
        return (
            one.describes_alike
            and one.batch_size == 1
            and type(one) is type(same)
            and one.config == same.config
            and self._cloud_kind == other._cloud_kind
            and self._protocol.half_extent == other._protocol.half_extent
            and "places" in other._members
        )

    @property
    def frames(self) -> set[int]:
        return set().union(*self._members.values())

    @property
    def cost(self) -> DescribingCost:
        """What the descriptors have taken."""
        if not self._spent_ns and self._alike is not None:
            return self._alike.cost  # It has described all of these queries.
        first, *others = self._spent_ns
        return DescribingCost(
            self._cloud_kind.num_scans,
            float(np.mean(self._num_points)),
            1e-9 * float(np.median(others or [first])),
        )

    def add(self, seen: _FrameClouds) -> None:
        """Adds a frame as a place, a query or both.

        Frames are described together, once enough of them for a batch have been
        added.
        """
        clouds = {
            role: seen.cloud(
                seen.sensor(self._protocol) if role == "queries" else None,
                self._cloud_kind,
                self._protocol.half_extent,
            )
            for role, members in self._members.items()
            if seen.frame in members
        }
        if clouds:
            self._waiting.append((seen.frame, clouds))
        if len(self._waiting) >= self._method.batch_size:
            self._describe_waiting()

    def finish(self) -> DriveDescriptors:
        """Returns the descriptors of all frames that were added."""
        self._describe_waiting()
        return self._drive

    def _describe_waiting(self) -> None:
        """Describes the waiting frames; none waits afterwards.

        A frame that is a place and a query with the same cloud is described
        once, if the method describes both alike.
        """
        places = self._describe("places", {})
        shared = {}
        if self._method.describes_alike:
            shared = {
                frame: places[frame]
                for frame, clouds in self._waiting
                if frame in places and clouds.get("queries") is clouds["places"]
            }
            shared |= self._described_by_another()
        self._describe("queries", shared)
        self._waiting = []

    def _described_by_another(self) -> dict[int, object]:
        """Returns frame -> descriptor of waiting queries, as far as known."""
        other = self._alike
        if other is None:
            return {}
        places = other._drive.places
        return {
            frame: places.descriptors[
                int(np.searchsorted(places.frames, frame))
            ]
            for frame, clouds in self._waiting
            if "queries" in clouds
            and frame in other._members["places"]
            and self._protocol.query_sensor(frame) is None
        }

    def _describe(
        self, role: Role, known: Mapping[int, object]
    ) -> dict[int, object]:
        """Describes the waiting frames of a role, except frames in `known`.

        Returns:
            Frame -> descriptor.
        """
        chosen = {
            frame: clouds[role]
            for frame, clouds in self._waiting
            if role in clouds
        }
        asked = {k: cloud for k, cloud in chosen.items() if k not in known}
        found: list = []
        if asked:
            start = time.process_time_ns()
            found = self._method.describe_batch(
                list(asked.values()), of_places=role == "places"
            )
            self._spent_ns.append((time.process_time_ns() - start) / len(asked))
            self._num_points += map(len, asked.values())
        check_number(self._method, "describe_batch", found, len(asked))
        described = {**known, **dict(zip(asked, found, strict=True))}
        drive = self._drive
        scans = drive.places if role == "places" else drive.queries
        descriptors: Any = scans.descriptors
        clouds: Any = scans.clouds
        for frame, cloud in chosen.items():
            descriptors.append(described[frame])
            if self._method.rerank_best:
                clouds.append(cloud)
        return described
