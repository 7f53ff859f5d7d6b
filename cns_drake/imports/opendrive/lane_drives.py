"""Drives in the middle of lanes, from lane to lane where they meet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from cns_drake.imports.opendrive.lane_bands import LaneBand
from cns_drake.imports.opendrive.lane_kinds import DRIVEN
from cns_drake.motion.control_points import POINT_SPACING
from cns_drake.motion.path_geometry import SmoothPath
from cns_drake.roads.u_turn import TIGHTEST_RADIUS
from cns_drake.roads.waypoints import make_waypoint_path

# Lanes follow one another where the end of one is so near the beginning of
# the other, and they point the same way [m, rad].
_NEAR = 0.6
_ASTRAY = np.radians(20.0)
# A car needs so much at the ends of a lane [m].
_LEAST_WIDTH = 1.8
_LEAST_LENGTH = 0.05
# No drive is longer, and none shorter [m].
_LONGEST = 1500.0
_SHORTEST = 80.0
# Of the first drive: where the second joins it, from and to, and until where
# it has left; both if no better is found; how much they share at least; and
# what the second has to itself at either end [m].
_SHARED = (0.25, 0.5, 0.75)
_SHARED_AT_WORST = (0.0, 0.7, 1.0)
_LEAST_SHARED = 0.15
# As many places to join and to leave are tried.
_MOST_PLACES = 12
_SHORTEST_ARM = 40.0
# Between waypoints [m].
_SPACING = 2.0
# Drives are straightened over so many waypoints to both sides, as tried.
_SMOOTHING = (0, 1, 2, 3)
# As many lanes may be too tight.
_MOST_CLOSED = 30
# As many lanes are tried as beginnings of the first drive.
_MOST_BEGINNINGS = 1000


@dataclass(frozen=True)
class LaneDrive:
    """A drive along lanes.

    Attributes:
        waypoints: (N, 3) on the road [m].
        limit: the lowest speed limit on the way, or none [m/s].
    """

    waypoints: np.ndarray
    limit: float | None

    @property
    def length(self) -> float:
        return float(
            np.linalg.norm(np.diff(self.waypoints, axis=0), axis=1).sum()
        )

    @property
    def path(self) -> np.ndarray:
        """The waypoints from above, (N, 2) [m]."""
        return self.waypoints[:, :2]


class _LaneGraph:
    """Lanes of sections as they are driven, each linked to those after it."""

    def __init__(self, bands: Sequence[LaneBand]):
        self.bands = [band for band in bands if _is_driven(band)]
        self.lines = [_driven_line(band) for band in self.bands]
        self.lengths = np.array(
            [
                np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
                for line in self.lines
            ]
        )
        # What a drive uses up: a road, or a lane of a junction.
        self.roads = [band.road.name for band in self.bands]
        self.links = self._link()

    def _link(self) -> coo_array:
        count = len(self.lines)
        starts = np.array([line[0] for line in self.lines]).reshape(-1, 3)
        ends = np.array([line[-1] for line in self.lines]).reshape(-1, 3)
        first = np.array([_heading(x[:2]) for x in self.lines]).reshape(-1)
        last = np.array([_heading(x[-2:]) for x in self.lines]).reshape(-1)
        rows, columns = [], []
        if count:
            near = cKDTree(starts).query_ball_point(ends, _NEAR)
            for k, some in enumerate(near):
                for m in sorted(some):
                    turn = (first[m] - last[k] + np.pi) % (2 * np.pi) - np.pi
                    if m != k and abs(turn) < _ASTRAY:
                        rows.append(k)
                        columns.append(m)
        cost = (self.lengths[rows] + self.lengths[columns]) / 2.0
        return coo_array((cost, (rows, columns)), (count, count)).tocsr()

    def close(self, lane: int) -> None:
        """Takes a lane out, that no car can steer along."""
        self.links = self.without(set(), {lane})

    def without(self, roads: set[str], lanes: set[int]) -> coo_array:
        """Returns the links that no closed road or lane is part of."""
        links = self.links.tocoo()
        is_open = np.array(
            [
                road not in roads and k not in lanes
                for k, road in enumerate(self.roads)
            ]
        )
        kept = is_open[links.row] & is_open[links.col]
        return coo_array(
            (links.data[kept], (links.row[kept], links.col[kept])), links.shape
        ).tocsr()


def find_lane_drives(bands: Sequence[LaneBand]) -> list[LaneDrive]:
    """Returns two drives that share a part, or one, or none.

    The first is the longest of the shortest ways from lane to lane, on which
    no road comes twice; the second shares its middle part, and begins and
    ends on other roads.

    Args:
        bands: lanes of the whole network, on bridges too.
    """
    graph = _LaneGraph(bands)
    if not graph.bands:
        return []
    drive = None
    for _ in range(_MOST_CLOSED):
        first = _longest(graph)
        drive = _drive(graph, first)
        if drive is not None or not first:
            break
    if drive is None:
        return []
    for strict in (True, False):
        for candidate in _seconds(graph, first, strict):
            second = _drive(graph, candidate)
            if second is not None:
                return [drive, second]
    return [drive]


def _is_driven(band: LaneBand) -> bool:
    width = band.width
    return (
        band.kind in DRIVEN
        and min(width[0], width[-1]) > _LEAST_WIDTH
        and float(np.abs(np.diff(band.s)).sum()) > _LEAST_LENGTH
    )


def _driven_line(band: LaneBand) -> np.ndarray:
    """Returns the middle of a lane (N, 3) in the direction of its traffic."""
    along = (band.lane.number < 0) != band.road.keeps_left
    line = band.middle if along else band.middle[::-1]
    steps = np.linalg.norm(np.diff(line[:, :2], axis=0), axis=1)
    kept = np.concatenate([[True], steps > 1e-3])
    kept[-1] = True
    return line[kept]


def _heading(two: np.ndarray) -> float:
    return float(np.arctan2(two[1, 1] - two[0, 1], two[1, 0] - two[0, 0]))


def _longest(graph: _LaneGraph) -> list[int]:
    """Returns the longest of the shortest ways that meet no road twice."""
    count = len(graph.bands)
    step = -(-count // _MOST_BEGINNINGS)
    best: list[int] = []
    reached = 0.0
    for k in range(0, count, step):
        cost, before = dijkstra(
            graph.links, indices=k, return_predecessors=True
        )
        cost = np.where(np.isfinite(cost), cost, -1.0)
        cost += np.where(cost >= 0.0, (graph.lengths + graph.lengths[k]) / 2, 0)
        for end in np.argsort(-cost, kind="stable")[:20].tolist():
            if min(cost[end], _LONGEST) <= reached + 1e-6:
                break
            way = _cut(graph, _way(before, k, end))
            length = float(graph.lengths[way].sum())
            if _meets_no_road_twice(graph, way) and length > reached + 1e-6:
                best, reached = way, length
                break
    return best


def _way(before: np.ndarray, start: int, end: int) -> list[int]:
    way = [end]
    while way[-1] != start:
        way.append(int(before[way[-1]]))
    return way[::-1]


def _cut(graph: _LaneGraph, way: list[int]) -> list[int]:
    """Returns as much of a way as a drive may have."""
    along = np.cumsum(graph.lengths[way])
    return way[: max(1, int(np.searchsorted(along, _LONGEST, "right")))]


def _meets_no_road_twice(graph: _LaneGraph, way: Sequence[int]) -> bool:
    """Tells whether a way comes back to no road, nor to a junction."""
    seen: set[str] = set()
    last = ""
    for k in way:
        road = graph.bands[k].road
        place = road.name if road.junction is None else f" {road.junction}"
        if place == last:
            continue
        if place in seen:
            return False
        seen.add(place)
        last = place
    return True


def _seconds(
    graph: _LaneGraph, first: list[int], strict: bool
) -> Iterator[list[int]]:
    """Yields ways that share the middle part of another, best first.

    Args:
        graph: of all lanes.
        first: the other way.
        strict: whether they have no other road in common, rather than no
            other lane.
    """
    along = np.concatenate([[0.0], np.cumsum(graph.lengths[first])])
    part = along / along[-1]
    low, middle, high = _SHARED if strict else _SHARED_AT_WORST
    lanes = range(len(first))
    begins = _some([k for k in lanes if low <= part[k] <= middle])
    ends = _some([k for k in lanes if 1 - middle <= part[k + 1] <= high])
    for begin in (*begins, None):
        head: list[int] = []
        start = 0 if begin is None else begin
        if begin is not None:
            used = first if strict else first[start:]
            head = _away(graph, first, used, first[begin], backwards=True)
            if not head:
                continue
        for end in (*ends[::-1], None):
            if begin is None and end is None:
                continue
            stop = len(first) - 1 if end is None else end
            if part[stop + 1] - part[start] < _LEAST_SHARED:
                continue
            shared = first[start : stop + 1]
            tail: list[int] = []
            if end is not None:
                used = [*(first if strict else shared), *head]
                tail = _away(graph, [*first, *head], used, first[end])
                if not tail:
                    continue
            way = [*head[:-1], *shared, *tail[1:]]
            if _meets_no_road_twice(graph, way):
                yield way


def _some(places: list[int]) -> list[int]:
    """Returns no more places than are tried, evenly chosen."""
    return places[:: -(-len(places) // _MOST_PLACES) or 1]


def _away(
    graph: _LaneGraph,
    lanes: Sequence[int],
    roads: Sequence[int],
    lane: int,
    backwards: bool = False,
) -> list[int]:
    """Returns the longest way from a lane, or to it.

    Args:
        graph: of all lanes.
        lanes: not to be used.
        roads: lanes on roads that are not to be used.
        lane: the first, or the last.
        backwards: whether it is the last.

    Returns:
        The way, empty if none is long enough.
    """
    closed = {graph.roads[k] for k in roads} - {graph.roads[lane]}
    links = graph.without(closed, set(lanes) - {lane})
    cost, before = dijkstra(
        links.T.tocsr() if backwards else links,
        indices=lane,
        return_predecessors=True,
        limit=_LONGEST / 3,
    )
    for end in np.argsort(-np.where(np.isfinite(cost), cost, -1.0)):
        if not np.isfinite(cost[end]):
            break
        way = _way(before, lane, int(end))
        if float(graph.lengths[way[1:]].sum()) < _SHORTEST_ARM:
            break
        if _meets_no_road_twice(graph, way):
            return way[::-1] if backwards else way
    return []


def _drive(graph: _LaneGraph, way: Sequence[int]) -> LaneDrive | None:
    """Returns a drive along lanes that a car can steer.

    None if it is too short, or a bend too tight, whose lane is then closed.
    """
    if not way:
        return None
    line = np.concatenate([graph.lines[k] for k in way])
    points = _resampled(_forwards(line))[: int(_LONGEST / _SPACING) + 1]
    limits = [limit for k in way for _, limit in graph.bands[k].road.limits]
    drive = LaneDrive(points, min(limits) if limits else None)
    if drive.length < _SHORTEST:
        return None
    place = points[0]
    for window in _SMOOTHING:
        smooth = _smoothed(points, window)
        path = make_waypoint_path(smooth, POINT_SPACING)
        bend, place = SmoothPath(path.points, path.spacing).tightest_bend()
        if bend >= TIGHTEST_RADIUS:
            return LaneDrive(smooth, drive.limit)
    graph.close(
        min(
            way,
            key=lambda k: float(
                np.hypot(*(graph.lines[k] - place)[:, :2].T).min()
            ),
        )
    )
    return None


def _smoothed(points: np.ndarray, window: int) -> np.ndarray:
    """Returns the means (N, 3) over points to both sides, as many as there
    are."""
    count = len(points)
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(points, axis=0)])
    at = np.arange(count)
    reach = np.minimum(np.minimum(at, count - 1 - at), window)
    return (total[at + reach + 1] - total[at - reach]) / (2 * reach + 1)[
        :, None
    ]


def _forwards(line: np.ndarray) -> np.ndarray:
    """Drops points that lie behind those before them, as at rough joints."""
    kept = [line[0], line[1]]
    for point in line[2:]:
        step, last = (point - kept[-1])[:2], (kept[-1] - kept[-2])[:2]
        size = float(np.hypot(*step))
        if size > 0.05 and step @ last > 0.5 * size * np.hypot(*last):
            kept.append(point)
    return np.array(kept)


def _resampled(line: np.ndarray) -> np.ndarray:
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    count = max(1, round(along[-1] / _SPACING))
    wanted = np.linspace(0.0, along[-1], count + 1)
    return np.column_stack([np.interp(wanted, along, x) for x in line.T])
