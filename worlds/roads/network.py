"""The road network of a town: roads and junctions, with lanes and areas."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
import itertools
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from shapely import STRtree
from shapely.geometry.base import BaseGeometry

from evaluation.base import InputError, value_errors, wrapped
from worlds.roads import carriageway
from worlds.roads.road import ENDS, Arm, End, Junction, Road
from worlds.roads.roads_file import RoadEntry, RoadsFile, read_roads_file
from worlds.shapes import DIRECTIONS, Centreline, LaneRef, blend

Turn = Literal["left", "straight", "right"]
# x, y, z [m] and heading [rad].
_Pose = tuple[float, float, float, float]

# A path through a junction is a turn if its heading changes by more than this.
_STRAIGHT_LIMIT_DEG = 35.0
# Beyond this change of heading it is a U-turn, which is not allowed.
_U_TURN_LIMIT_DEG = 150.0
# Roads may overlap by this much before they count as crossing [m^2].
_CROSSING_TOLERANCE = 1.0


@dataclass(frozen=True)
class Connection:
    """A path through a junction from one lane to another.

    Attributes:
        junction: name of the junction.
        incoming: the lane that leads to the junction.
        outgoing: the lane that comes from the junction.
        turn: direction of the path: left, right or straight on.
        points: (N, 3) points of the path, ends of both lanes included [m].
    """

    junction: str
    incoming: LaneRef
    outgoing: LaneRef
    turn: Turn
    points: np.ndarray


class RoadNetwork:
    """A road network: roads and junctions, with their lanes and areas.

    Attributes:
        roads: name of each road -> the road.
        junctions: name of each junction -> the junction.
    """

    def __init__(self, roads: dict[str, Road], junctions: dict[str, Junction]):
        self.roads = roads
        self.junctions = junctions
        self._lane_ends: dict[tuple[LaneRef, str], _Pose] = {}
        self._connections: dict[str, list[Connection]] = {}

    def exit_junction(self, lane: LaneRef) -> str:
        """Returns the name of the junction to which a lane leads."""
        road = self.roads[lane.road]
        return road.end if lane.direction == "forward" else road.start

    def entry_junction(self, lane: LaneRef) -> str:
        """Returns the name of the junction from which a lane comes."""
        road = self.roads[lane.road]
        return road.start if lane.direction == "forward" else road.end

    def connection(
        self, incoming: LaneRef, outgoing: LaneRef, spacing: float = 1.0
    ) -> Connection:
        """Returns the path through a junction from one lane to another.

        The path need not be legal; see `RoadNetwork.is_legal`. The points of
        the path are about `spacing` apart [m].

        Raises:
            ValueError: a lane does not exist, the lanes do not meet in a
                junction, or the path would be a U-turn.
        """
        junction = self.exit_junction(incoming)
        if junction != self.entry_junction(outgoing):
            raise ValueError(
                f"road {incoming.road} {incoming.direction} ends at "
                f"{junction}, road {outgoing.road} {outgoing.direction} "
                f"starts at {self.entry_junction(outgoing)}"
            )
        if self._is_u_turn(incoming, outgoing):
            raise ValueError(
                f"U-turn from road {incoming.road} to road {outgoing.road}"
            )
        a, b = self._ends(incoming, outgoing)
        place = self.junctions[junction]
        turn = _turn_of(_turn_deg(a, b), len(place.arms))
        # In a right turn, the outermost lane follows the kerb.
        width = self.roads[outgoing.road].lane_width
        radius = place.kerb_radius + width / 2 if turn == "right" else np.inf
        xy = blend(a[:2], a[3], b[:2], b[3], spacing, radius)
        z = np.full((len(xy), 1), place.height)
        return Connection(
            junction, incoming, outgoing, turn, np.hstack([xy, z])
        )

    def _is_u_turn(self, incoming: LaneRef, outgoing: LaneRef) -> bool:
        """Returns whether the second of two lanes that meet leads back.

        The second lane leads back if it is the opposite direction of the first
        lane's road. It also leads back if the lanes are on two roads that are
        the separate directions of one road, such as before a roundabout.
        """
        if incoming.road == outgoing.road:
            return incoming.direction != outgoing.direction
        return (
            abs(_turn_deg(*self._ends(incoming, outgoing))) > _U_TURN_LIMIT_DEG
        )

    def _ends(
        self, incoming: LaneRef, outgoing: LaneRef
    ) -> tuple[_Pose, _Pose]:
        """Returns the poses at which `incoming` ends and `outgoing` begins."""
        # The poses are cached, because each pair of lanes asks for them.
        wanted = (incoming, "exit"), (outgoing, "entry")
        for lane, end in wanted:
            if (lane, end) not in self._lane_ends:
                pose = self.roads[lane.road].lane_end(*lane[1:], end)
                self._lane_ends[lane, end] = pose
        return self._lane_ends[wanted[0]], self._lane_ends[wanted[1]]

    def lanes(self) -> Iterator[LaneRef]:
        """Yields every lane of every road."""
        for road in self.roads.values():
            for direction in DIRECTIONS:
                for lane in range(1, road.lanes[direction] + 1):
                    yield LaneRef(road.name, direction, lane)

    def is_legal(self, connection: Connection) -> bool:
        """Returns whether traffic may take a path through a junction.

        A left turn leads from the innermost lane to the innermost lane, and a
        right turn from the outermost lane to the outermost lane. A path
        straight on leads to the lane with the same number, counted from the
        middle of the road. Between one-way roads, such as the roads of a
        roundabout, every path leads to the lane with the same number, counted
        from the kerb on the right.
        """
        incoming, outgoing = connection.incoming, connection.outgoing
        if all(self._is_one_way(lane) for lane in (incoming, outgoing)):
            return self._from_kerb(incoming) == self._from_kerb(outgoing)
        if connection.turn == "left":
            return incoming.lane == outgoing.lane == 1
        if connection.turn == "straight":
            return incoming.lane == outgoing.lane
        return self._from_kerb(incoming) == self._from_kerb(outgoing) == 0

    def _is_one_way(self, lane: LaneRef) -> bool:
        return not all(self.roads[lane.road].lanes.values())

    def _from_kerb(self, lane: LaneRef) -> int:
        """Returns the number of lanes between a lane and its kerb."""
        return self.roads[lane.road].lanes[lane.direction] - lane.lane

    def connections(self, junction: str) -> list[Connection]:
        """Returns every legal path through a junction."""
        if junction not in self._connections:
            self._connections[junction] = list(
                self._legal_connections(junction)
            )
        return self._connections[junction]

    def _legal_connections(self, junction: str) -> Iterator[Connection]:
        """Yields every legal path through a junction, computed anew."""
        lanes = list(self.lanes())
        incoming = [a for a in lanes if self.exit_junction(a) == junction]
        outgoing = [b for b in lanes if self.entry_junction(b) == junction]
        for a, b in itertools.product(incoming, outgoing):
            if not self._is_u_turn(a, b):
                connection = self.connection(a, b)
                if self.is_legal(connection):
                    yield connection

    @cached_property
    def junction_areas(self) -> dict[str, BaseGeometry]:
        """The area of each junction by name, bounded by road ends and kerbs."""
        return {
            name: carriageway.junction_area(self.roads, junction)
            for name, junction in self.junctions.items()
        }

    @cached_property
    def areas(self) -> carriageway.Areas:
        """The areas of all streets.

        Raises:
            ValueError: the outline of a road or junction crosses itself.
        """
        return carriageway.make_areas(self.roads, self.junction_areas)


def _turn_deg(a: _Pose, b: _Pose) -> float:
    """Returns the angle from a's heading to b's, positive to the left."""
    return float(np.degrees(wrapped(b[3] - a[3])))


def _turn_of(angle_deg: float, num_arms: int) -> Turn:
    """Returns the kind of turn for an angle, positive to the left.

    Where a junction has only two roads, all turns are straight on.
    """
    if num_arms == 2 or abs(angle_deg) <= _STRAIGHT_LIMIT_DEG:
        return "straight"
    return "left" if angle_deg > 0 else "right"


class _RoadEnd(NamedTuple):
    """An end of a road at a junction: an `Arm` whose setback is unknown."""

    heading: float
    road: str
    end: End
    half_width: float


def load_road_network(path: Path | str) -> RoadNetwork:
    """Reads and checks the road network in a `roads.yaml`.

    Raises:
        InputError: the file has a wrong form, a road leads to an unknown
            junction, a junction has fewer than two roads, a road has no lanes,
            a corner or junction does not fit, or roads cross without a
            junction. The message names file, field and fault.

    Example:
        from worlds import load_road_network, shipped_maps

        path = shipped_maps()["suburbia"] / "roads.yaml"
        print(sorted(load_road_network(path).roads))
    """
    path = Path(path)
    file = read_roads_file(path)
    curves = {
        name: _make_curve(path, file, name, entry)
        for name, entry in file.roads.items()
    }
    junctions = {
        name: _make_junction(path, file, name, curves)
        for name in file.junctions
    }
    roads = {}
    for name, entry in file.roads.items():
        ends = [junctions[entry.start], junctions[entry.end]]
        setbacks = [
            arm.setback
            for junction, end in zip(ends, ENDS, strict=True)
            for arm in junction.arms
            if (arm.road, arm.end) == (name, end)
        ]
        heights = [junction.height for junction in ends]
        with value_errors(f"{path}: roads.{name}"):
            roads[name] = Road(name, entry, curves[name], setbacks, heights)
    network = RoadNetwork(roads, junctions)
    _check_crossings(path, network)
    return network


def _make_curve(
    path: Path, file: RoadsFile, name: str, entry: RoadEntry
) -> Centreline:
    """Returns the centreline of a road, from junction to junction.

    Raises:
        InputError: a junction of the road does not exist, the road has no lane,
            or a corner does not fit.
    """
    for field in ENDS:
        junction = getattr(entry, field)
        if junction not in file.junctions:
            raise InputError(
                f"{path}: roads.{name}.{field}: no junction {junction!r}"
            )
    if not any(entry.lanes):
        raise InputError(f"{path}: roads.{name}.lanes: the road has no lane")
    points = [
        file.junctions[entry.start].position,
        *((x, y) for x, y, _ in entry.via),
        file.junctions[entry.end].position,
    ]
    place = "via" if entry.via else "start, end"
    with value_errors(f"{path}: roads.{name}.{place}"):
        return Centreline(points, [radius for _, _, radius in entry.via])


def _make_junction(
    path: Path, file: RoadsFile, name: str, curves: Mapping[str, Centreline]
) -> Junction:
    """Returns a junction with its arms.

    Raises:
        InputError: too few roads end at the junction.
    """
    entry = file.junctions[name]
    ends: list[_RoadEnd] = []
    for road_name, road in file.roads.items():
        if name not in (road.start, road.end):
            continue
        width = road.lane_width * sum(road.lanes) + road.median
        first, last = curves[road_name].evaluate([0, curves[road_name].length])
        if road.start == name:
            ends.append(_RoadEnd(first[2], road_name, "start", width / 2))
        if road.end == name:
            ends.append(_RoadEnd(last[2] + np.pi, road_name, "end", width / 2))
    if (len(ends) == 1) != entry.dead_end or not ends:
        wanted = "exactly 1 at a dead end" if entry.dead_end else "at least 2"
        advice = ""
        if len(ends) == 1:
            advice = "; if traffic cannot go on here, write dead_end: true"
        raise InputError(
            f"{path}: junctions.{name}: {len(ends)} road(s) end here, "
            f"{wanted} must{advice}"
        )
    ends = sorted(
        end._replace(heading=end.heading % (2 * np.pi)) for end in ends
    )
    arms = []
    for k, (heading, road_name, end, half_width) in enumerate(ends):
        setback = getattr(file.roads[road_name], f"{end}_setback")
        if setback is None:
            setback = _derived_setback(ends, k, entry.kerb_radius)
        arms.append(Arm(road_name, end, heading, half_width, setback))
    return Junction(
        name, entry.position, entry.height, entry.kerb_radius, tuple(arms)
    )


def _derived_setback(
    ends: Sequence[_RoadEnd], k: int, kerb_radius: float
) -> float:
    """Returns the setback that the corners beside the k-th end require [m]."""
    if len(ends) == 1:
        return kerb_radius
    heading, half_width = ends[k].heading, ends[k].half_width
    before, after = ends[k - 1], ends[(k + 1) % len(ends)]
    return max(
        carriageway.corner_setback(
            half_width, other.half_width, angle % (2 * np.pi), kerb_radius
        )
        for other, angle in (
            (before, heading - before.heading),
            (after, after.heading - heading),
        )
    )


def _check_crossings(path: Path, network: RoadNetwork) -> None:
    """Checks that roads cross in junctions only.

    Raises:
        InputError: two roads overlap outside a junction.
    """
    names = list(network.roads)
    strips = []
    for name in names:
        with value_errors(f"{path}: roads.{name}"):
            strips.append(carriageway.road_strip(network.roads[name]))
    pairs = STRtree(strips).query(strips, predicate="intersects")
    for a, b in sorted(pairs.T.tolist()):
        if a < b and strips[a].intersection(strips[b]).area > (
            _CROSSING_TOLERANCE
        ):
            raise InputError(
                f"{path}: roads.{names[a]}: meets road {names[b]} outside a "
                "junction; add one there"
            )
