"""Layered overlap: a matched filter on binary maps, robust to change.

A scan becomes maps from above: one for each layer of height, one for poles and
one for kerbs. Two scans are compared at the pose at which the greatest number
of their filled cells coincide. Objects that are gone or new merely lower this
number; all unchanged objects still coincide at one pose.

Matched filters for place recognition come from Joseph, Fischer and Milford
(arXiv 2409.03998), who use one map of occupied cells. Layered overlap adds the
layers, the poles and the kerbs, and counts bits instead of computing a Fourier
transform.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
import hashlib
import itertools
import math
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from pydantic import NonNegativeInt, PositiveFloat, PositiveInt

from evaluation.base import compiled, poses
from evaluation.maps import extremes
from evaluation.methods.method import Method, MethodConfig
from evaluation.methods.registry import register

# Rows and columns of the grid: a cell's number, row times 256 plus column, is
# a uint16.
GRID = 256
NUM_LAYERS = 5
# Heights above the ground [m]: the top of the ground, of the low layer and of
# the middle layer.
_HEIGHTS = np.array([0.35, 1.5, 4.0])
# Least height of a pole [m].
_POLE_TOP = 2.0
# Greatest number of cells of a pole among 3 x 3 cells; the 7 x 7 cells around
# must otherwise be free.
_POLE_CELLS = 4
# Range of the ground's rise within a cell with a kerb [m].
_KERB_STEP = (0.08, 0.30)
# The ground is followed outwards in this number of sectors, in steps of this
# length [m].
_SECTORS = 90
_RING = 2.0
# Greatest change of the ground's height from one step to the next [m].
_GROUND_STEP = 0.15
# Greatest slope of the ground.
_GROUND_SLOPE = 0.2


def _moves(turn: int, shift: int) -> np.ndarray:
    """Returns all changes (K, 3) of heading, row and column up to a limit."""
    near = range(-shift, shift + 1)
    return np.array([*itertools.product(range(-turn, turn + 1), near, near)])


# Coarse map of each layer: low and middle points share one; high points, poles
# and kerbs have one each.
_MAPS = np.array([0, 0, 1, 2, 3])
# The first search: cells of 4 m and steps of 15 deg. All shifts within reach
# are tried, except in the corners, which are too far away for a match.
_FIRST_HALVINGS = 3
_FIRST_WEIGHTS = np.array([1, 1, 2, 2])
# Rows and columns added around the cells of a place: twice the greatest step of
# a climb, which is 6 cells, plus one.
_MARGIN = 13
# The unit of sines and cosines is 2 to minus this power.
_UNIT_BITS = 14
# Mask of every second bit.
_EVERY_2ND = np.uint64(0x5555555555555555)
# Mask of every second pair of bits.
_PAIRS = np.uint64(0x3333333333333333)
# Mask of every second nibble.
_NIBBLES = np.uint64(0x0F0F0F0F0F0F0F0F)
# Mask of the first bit of every byte.
_BYTES = np.uint64(0x0101010101010101)


def turns(number: int) -> np.ndarray:
    """Returns the cosines and sines of H angles that divide 360 deg evenly.

    Returns:
        (H, 2) int64, in units of 2^-14.
    """
    unit = 1 << _UNIT_BITS
    angles = [2.0 * math.pi * step / number for step in range(number)]
    return np.array(
        [(round(unit * math.cos(a)), round(unit * math.sin(a))) for a in angles]
    )


@compiled
def coarse_maps(
    cells: np.ndarray,
    starts: np.ndarray,
    turns: np.ndarray,
    halvings: int,
    maps: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns coarse occupancy maps of a scan, rotated to several headings.

    Args:
        cells: (M,) uint16 occupied cells of all layers, see `layer_cells`.
        starts: (layers + 1,) index in `cells` at which each layer begins; the
            last entry is M.
        turns: (H, 2) int64 cosines and sines of the angles by which the scan is
            rotated about the sensor, in units of 2^-14.
        halvings: how often the number of rows and columns is halved; at least
            2, since a row must fit into 64 bits.
        maps: (layers,) int64, number of the map, from 0 to S - 1, that contains
            each layer.

    Returns:
        (H, S, R) uint64, the R rows of the S maps at each heading; bit k of a
        row is set if column k is occupied. (H, S) int64, the number of occupied
        cells of each map.
    """
    rows = GRID >> halvings
    num_maps = maps.max() + 1
    bits = np.zeros((len(turns), num_maps, rows), np.uint64)
    counts = np.zeros((len(turns), num_maps), np.int64)
    for heading in range(len(turns)):
        c, s = turns[heading]
        for layer in range(NUM_LAYERS):
            for i in range(starts[layer], starts[layer + 1]):
                u = 2 * (np.int64(cells[i]) >> 8) + 1 - GRID
                v = 2 * (np.int64(cells[i]) & 255) + 1 - GRID
                x = c * u - s * v + (GRID << _UNIT_BITS)
                y = s * u + c * v + (GRID << _UNIT_BITS)
                # One bit more than the unit turns half cells into cells.
                row = x >> (_UNIT_BITS + 1 + halvings)
                column = y >> (_UNIT_BITS + 1 + halvings)
                if 0 <= row < rows and 0 <= column < rows:
                    bit = np.uint64(1) << np.uint64(column)
                    is_new = bits[heading, maps[layer], row] & bit == 0
                    bits[heading, maps[layer], row] |= bit
                    counts[heading, maps[layer]] += is_new
    return bits, counts


@compiled
def best_overlaps(
    queries: np.ndarray,
    places: np.ndarray,
    weights: np.ndarray,
    starts: np.ndarray,
    moves: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the best poses of a query near N initial poses, by overlap.

    A scan is a stack of S binary maps, see `coarse_maps`. Each map has R rows.
    A row is one 64-bit word, with one bit per column. The overlap is the
    weighted number of bits that are set in the maps of both scans.

    Args:
        queries: (H, S, R) uint64 maps of the query, at H headings that divide
            360 deg evenly.
        places: (D, S, R + 2 * margin) uint64 maps of the places, with `margin`
            empty rows before and after the R rows of each map.
        weights: (S,) int64 weight of a bit of each map.
        starts: (N, 4) int64 initial poses: number of the place, number of the
            heading, and shifts of the query by rows and by columns.
        moves: (K, 3) int64 changes of heading and shifts to try for each
            initial pose.

    Returns:
        For each initial pose: the greatest overlap, (N,) int64; and the number
        of the heading and the shifts by rows and by columns at which it occurs,
        (N, 3) int64. If several of the `moves` give this overlap, the first one
        counts. If all `moves` shift the query by more than `margin` rows, the
        overlap is -1.
    """
    num_headings, num_maps, num_rows = queries.shape
    margin = (places.shape[2] - num_rows) // 2
    least_up = starts[:, 3].min() + moves[:, 2].min()
    most_up = starts[:, 3].max() + moves[:, 2].max()
    # The query's maps, shifted by columns when a shift is first needed.
    num_ups = most_up - least_up + 1
    shifted = np.empty((num_headings, num_ups, num_maps, num_rows), np.uint64)
    is_shifted = np.zeros((num_headings, num_ups), np.bool_)
    counts = np.full(len(starts), -1, np.int64)
    poses = np.zeros((len(starts), 3), np.int64)
    for n in range(len(starts)):
        for k in range(len(moves)):
            heading = (starts[n, 1] + moves[k, 0]) % num_headings
            right = starts[n, 2] + moves[k, 1]
            up = starts[n, 3] + moves[k, 2]
            if abs(right) > margin:
                continue
            query = shifted[heading, up - least_up]
            if not is_shifted[heading, up - least_up]:
                is_shifted[heading, up - least_up] = True
                to_right = np.uint64(max(-up, 0))
                to_left = np.uint64(max(up, 0))
                for of_map in range(num_maps):
                    for row in range(num_rows):
                        query[of_map, row] = (
                            queries[heading, of_map, row] << to_left >> to_right
                        )
            total = 0
            for of_map in range(num_maps):
                of_query = query[of_map]
                of_place = places[starts[n, 0], of_map, margin + right :]
                number = np.uint64(0)
                for row in range(num_rows):
                    bits = of_query[row] & of_place[row]
                    # Bits are counted in pairs, nibbles, bytes, then all at
                    # once, for which compilers have an instruction.
                    bits -= (bits >> np.uint64(1)) & _EVERY_2ND
                    bits = (bits & _PAIRS) + ((bits >> np.uint64(2)) & _PAIRS)
                    bits = (bits + (bits >> np.uint64(4))) & _NIBBLES
                    number += bits * _BYTES >> np.uint64(56)
                total += weights[of_map] * np.int64(number)
            if total > counts[n]:
                counts[n] = total
                poses[n, 0], poses[n, 1], poses[n, 2] = heading, right, up
    return counts, poses


@compiled
def climb(
    cells: np.ndarray,
    starts: np.ndarray,
    place_cells: np.ndarray,
    place_starts: np.ndarray,
    weights: np.ndarray,
    turns: np.ndarray,
    start: np.ndarray,
    steps: np.ndarray,
) -> np.ndarray:
    """Returns the pose at which a query overlaps a place most.

    A filled cell of the query overlaps the place if the place has a filled cell
    at the same or an adjacent position in the same layer. The search is hill
    climbing: it moves to the best of the 26 neighbours of a pose until no
    neighbour is better than the pose, then continues with smaller steps.

    Args:
        cells: (M,) uint16 of the query, see `layer_cells`.
        starts: (layers + 1,) index in `cells` at which each layer begins; the
            last entry is M.
        place_cells: (N,) uint16 of the place.
        place_starts: (layers + 1,) index in `place_cells` at which each layer
            begins; the last entry is N.
        weights: (layers,) int64 weight of a common cell in each layer.
        turns: (H, 2) int64 cosines and sines of H angles that divide 360 deg
            evenly.
        start: (3,) int64 initial pose: index of the angle in `turns`, and the
            shifts along rows and along columns in half cells.
        steps: (K, 2) int64 steps of the angle's index and of the shifts, from
            coarse to fine. The steps of the shifts are even.

    Returns:
        (3 + layers,) int64: the pose, and how many of the query's cells overlap
        the place in each layer.
    """
    place = _widened_grid(place_cells, place_starts)
    common = np.zeros((3, 3, NUM_LAYERS), np.int64)
    pose = start.copy()
    _count_common(cells, starts, place, turns, pose, 1, common)
    best = np.concatenate((start, common[1, 1]))
    most = (common[1, 1] * weights).sum()
    move = (0, 0, 0)
    for level in range(len(steps)):
        step = steps[level, 1]
        # The last move of the centre, in steps; at first a move from out of
        # reach.
        last = (3, 3, 3)
        while True:
            centre = best.copy()
            before = most
            for dt in range(-1, 2):
                # Poses that were neighbours of the previous centre are no
                # better.
                if abs(last[0] + dt) <= 1 and last[1] == 0 and last[2] == 0:
                    continue
                pose[0] = (centre[0] + dt * steps[level, 0]) % len(turns)
                pose[1], pose[2] = centre[1], centre[2]
                _count_common(
                    cells, starts, place, turns, pose, step // 2, common
                )
                for dr in range(-1, 2):
                    for dc in range(-1, 2):
                        total = 0
                        for layer in range(NUM_LAYERS):
                            total += (
                                common[dr + 1, dc + 1, layer] * weights[layer]
                            )
                        if total > most:
                            most = total
                            best[0] = pose[0]
                            best[1] = centre[1] + dr * step
                            best[2] = centre[2] + dc * step
                            for layer in range(NUM_LAYERS):
                                best[3 + layer] = common[dr + 1, dc + 1, layer]
                            move = (dt, dr, dc)
            if most == before:
                break
            last = move
    return best


@compiled
def _widened_grid(cells: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Returns a grid (layers, S, S) of filled cells and their neighbours.

    The grid has a margin of empty cells around the map. The arguments are the
    cells of a place as for `climb`.
    """
    size = GRID + 2 * _MARGIN
    grid = np.zeros((NUM_LAYERS, size, size), np.uint8)
    for layer in range(NUM_LAYERS):
        for i in range(starts[layer], starts[layer + 1]):
            row, column = int(cells[i]) >> 8, int(cells[i]) & 255
            for r in range(max(row - 1, 0), min(row + 2, GRID)):
                for c in range(max(column - 1, 0), min(column + 2, GRID)):
                    grid[layer, _MARGIN + r, _MARGIN + c] = 1
    return grid


@compiled
def _count_common(
    cells: np.ndarray,
    starts: np.ndarray,
    place: np.ndarray,
    turns: np.ndarray,
    pose: np.ndarray,
    step: int,
    common: np.ndarray,
) -> None:
    """Counts the common cells of two scans, layer by layer, near a pose.

    The shifts are whole cells, so that each cell needs to be rotated only once.

    Args:
        cells, starts, turns: see `climb`.
        place: (layers, rows, columns) uint8, 1 where the place has a cell or a
            neighbour of one; `_MARGIN` more rows and columns on every side.
        pose: (3,) int64.
        step: shift k in whole cells, from 1 to 6.
        common: (3, 3, layers) int64 to fill: for shifts by -k, 0 and k
            along rows and along columns.
    """
    c, s = turns[pose[0], 0], turns[pose[0], 1]
    right, up = (pose[1] + GRID) << _UNIT_BITS, (pose[2] + GRID) << _UNIT_BITS
    # There are no cells outside the map.
    last = GRID + step
    common[:] = 0
    for layer in range(NUM_LAYERS):
        for i in range(starts[layer], starts[layer + 1]):
            u = 2 * (np.int64(cells[i]) >> 8) + 1 - GRID
            v = 2 * (np.int64(cells[i]) & 255) + 1 - GRID
            # One bit more than the unit turns half cells into cells.
            row = (c * u - s * v + right) >> (_UNIT_BITS + 1)
            column = (s * u + c * v + up) >> (_UNIT_BITS + 1)
            row = _MARGIN + min(max(row, -1 - step), last)
            column = _MARGIN + min(max(column, -1 - step), last)
            for dr in range(3):
                for dc in range(3):
                    common[dr, dc, layer] += place[
                        layer, row + (dr - 1) * step, column + (dc - 1) * step
                    ]


_FIRST_TURNS = turns(24)
_FIRST_REACH = 2
_FIRST_MOVES = _moves(0, _FIRST_REACH)
_FIRST_MOVES = _FIRST_MOVES[np.abs(_FIRST_MOVES).sum(axis=1) < 2 * _FIRST_REACH]
# A large overlap at all headings is no sign of a match, because all scans have
# many points near their sensors. This share of the mean over headings is
# subtracted; trials led to it.
_MEAN_SHARE = 0.5
# The second and the third: cells of 2 m; steps of 5 deg, then of 2.5 deg.
_SECOND_HALVINGS = 2
_SECOND_WEIGHTS = np.array([1, 1, 4, 2])
_SECOND_TURNS = turns(144)
_SECOND_MOVES = _moves(1, 1) * [2, 1, 1]
_THIRD_MOVES = _moves(3, 2)
_SECOND_MARGIN = 2 * _FIRST_REACH + 3
# Factors from a pose of the first search (place, heading, shifts) to one of the
# second.
_TO_SECOND = np.array([1, 6, 2, 2])
# The last search: all cells; steps of 2.5 deg and 1 m, then half of these.
_LAST_TURNS = turns(288)
_LAST_STEPS = np.array([[2, 4], [1, 2]])
_TO_LAST = np.array([1, 2, 8, 8])
# Number of queries of which a database keeps climbs: about 5 MB.
_MOST_CLIMBED = 4096
_NO_CLIMBS = np.zeros((0, 7), np.int32)


class LayeredOverlapConfig(MethodConfig):
    """Settings of layered overlap.

    All values were chosen by trials on development worlds. The method finds the
    top-ranked place in four successive searches, from coarse to fine maps.

    Attributes:
        cell: side of a cell of the finest maps [m]. These maps have 256 x 256
            cells.
        min_points: least number of points in an occupied cell.
        poses: number of candidate poses (a place and a heading) that the first
            search passes to the second.
        refined: number of candidate poses that the second search passes to the
            third.
        candidates: number of places that the third search passes to the last,
            which compares maps cell by cell.
        weights: weights that a cell has in the score if both scans fill this
            cell, one weight per layer: low, middle and high points, poles,
            kerbs.
        least_cells: number that the score adds to the weighted number of filled
            cells of each scan, so that two nearly empty scans do not look
            alike.
    """

    cell: PositiveFloat = 0.5
    min_points: PositiveInt = 1
    poses: PositiveInt = 8000
    refined: PositiveInt = 250
    candidates: PositiveInt = 40
    weights: tuple[
        NonNegativeInt,
        NonNegativeInt,
        NonNegativeInt,
        NonNegativeInt,
        NonNegativeInt,
    ] = (3, 3, 2, 60, 5)
    least_cells: NonNegativeInt = 150


@dataclass(frozen=True)
class LayeredScan:
    """Descriptor of one cloud.

    Attributes:
        cells: (M,) uint16 numbers of the filled cells, layer by layer.
        starts: (6,) int64, index in `cells` at which each layer begins and the
            last one ends.
    """

    cells: np.ndarray
    starts: np.ndarray


class _FinePose(NamedTuple):
    """The best pose of two scans on fine maps; see `climb`.

    Attributes:
        heading: index of the heading in `_LAST_TURNS`.
        rows: shift along x, in half cells.
        columns: shift along y, in half cells.
        common: (5,) number of common cells in each layer.
    """

    heading: int
    rows: int
    columns: int
    common: np.ndarray


@dataclass(frozen=True)
class CoarseMaps:
    """Coarse occupancy maps of N places, or of a query at N headings.

    There are four maps for each place or heading: one for low and middle points
    together, and one each for high points, poles and kerbs.

    Attributes:
        bits: (N, 4, R) uint64, the R rows of each map. Bit k of a row is set if
            column k is occupied. Maps of places have additional empty rows at
            both ends.
        counts: (N, 4) int64 number of bits set in each map.
    """

    bits: np.ndarray
    counts: np.ndarray

    def chosen(self, indices: Sequence[int]) -> "CoarseMaps":
        """Returns the maps of some of the N places or headings."""
        return CoarseMaps(self.bits[indices], self.counts[indices])


@dataclass(frozen=True)
class LayeredDatabase:
    """Descriptors of D places.

    Attributes:
        places: the D descriptors.
        first: the coarsest maps of the places, for the first of the method's
            four searches.
        second: finer maps, for the second and the third search.
        climbed: what `score` found, for `relative_poses`: hash of the query's
            cells -> (K, 7) int32 place, heading and shifts at which a climb
            started, and heading and shifts at which it ended.
    """

    places: Sequence[LayeredScan]
    first: CoarseMaps
    second: CoarseMaps
    climbed: dict[bytes, np.ndarray] = field(default_factory=dict)


@register("layered-overlap")
class LayeredOverlap(Method[LayeredScan, LayeredDatabase]):
    """Layered overlap, in four searches from coarse to fine.

    The first three searches compare coarse maps. For each place, they find the
    pose at which the greatest number of cells is filled in both scans. They
    rank the places by how far this number of common cells exceeds the number
    that is expected by chance, in standard deviations. The last search improves
    the poses of the top-ranked places by hill climbing on fine maps.

    The score is the weighted number of common cells on the fine maps, divided
    by the geometric mean of the two scans' weighted numbers of filled cells. On
    these maps, a filled cell of the query is common if the place has a filled
    cell at the same or an adjacent position in the same layer.

    Of several poses with equal counts, the first pose is used. All counts are
    integers, so that scores are the same on every processor.
    """

    title = "Layered overlap"
    style = ("#E69F00", "-", "v")
    standard = True
    order = 5
    Config = LayeredOverlapConfig
    skips_places = True
    config: LayeredOverlapConfig

    def describe(self, points: np.ndarray) -> LayeredScan:
        config = self.config
        return LayeredScan(
            *layer_cells(
                points, config.sensor_height, config.cell, config.min_points
            )
        )

    def build_database(self, places: Sequence[LayeredScan]) -> LayeredDatabase:
        return LayeredDatabase(
            places,
            _maps_of_places(places, _FIRST_HALVINGS, _FIRST_REACH),
            _maps_of_places(places, _SECOND_HALVINGS, _SECOND_MARGIN),
        )

    def score(
        self,
        query: LayeredScan,
        database: LayeredDatabase,
        *,
        exhaustive: bool = False,
    ) -> np.ndarray:
        scores = np.full(len(database.places), np.nan)
        if len(query.cells) == 0:
            return scores
        config = self.config
        poses = _search(
            query, database, config.poses, config.refined, exhaustive
        )
        if not exhaustive:
            poses = poses[: config.candidates]
        climbed = []
        for pose in poses:
            place = database.places[pose[0]]
            if len(place.cells) > 0:
                found = self._climb(query, place, pose[1:])
                scores[pose[0]] = self._score(query, place, found)
                climbed.append((*pose, *found[:3]))
        while len(database.climbed) >= _MOST_CLIMBED:
            del database.climbed[next(iter(database.climbed))]
        database.climbed[_key(query)] = np.array(
            climbed[: config.candidates], np.int32
        ).reshape(-1, 7)
        return scores

    def relative_poses(
        self,
        query: LayeredScan,
        database: LayeredDatabase,
        places: Sequence[int],
    ) -> list[np.ndarray | None]:
        """Returns the poses X_PQ (4, 4) of a query's LiDAR at several places.

        X_PQ is relative to the LiDAR at the place, and consists of a yaw and a
        horizontal translation. The result is None for a place if its scan or
        the scan of the query has no filled cell.
        """
        scans = [database.places[place] for place in places]
        poses: list[np.ndarray | None] = [None] * len(scans)
        if len(query.cells) == 0 or len(scans) == 0:
            return poses
        # An exhaustive search refines every place at every heading.
        every = len(scans) * len(_FIRST_TURNS)
        chosen = list(places)
        database_of_places = LayeredDatabase(
            scans,
            database.first.chosen(chosen),
            database.second.chosen(chosen),
        )
        climbed = {
            tuple(row[:4]): row[4:]
            for row in database.climbed.get(_key(query), _NO_CLIMBS).tolist()
        }
        for start in _search(query, database_of_places, every, every):
            k = start[0]
            if len(scans[k].cells) > 0:
                # A climb from the same start ends at the same pose.
                found = climbed.get((places[k], *start[1:].tolist()))
                if found is None:
                    found = self._climb(query, scans[k], start[1:])[:3]
                poses[k] = self._to_pose(*found)
        return poses

    def _to_pose(self, heading: int, rows: int, columns: int) -> np.ndarray:
        """Returns X_PQ (4, 4) for a pose on fine maps, see `_FinePose`."""
        c, s = _LAST_TURNS[heading] / _LAST_TURNS[0, 0]
        R_PQ = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        half_cell = 0.5 * self.config.cell
        x, y = rows * half_cell, columns * half_cell
        return poses.make_pose(R_PQ, np.array([x, y, 0.0]))

    def _climb(
        self, query: LayeredScan, place: LayeredScan, start: np.ndarray
    ) -> _FinePose:
        """Returns the best pose of two scans, found by hill climbing.

        Args:
            start: (3,) heading and shifts at which the search starts.
        """
        heading, rows, columns, *common = climb(
            query.cells,
            query.starts,
            place.cells,
            place.starts,
            np.array(self.config.weights),
            _LAST_TURNS,
            start,
            _LAST_STEPS,
        ).tolist()
        return _FinePose(heading, rows, columns, np.array(common))

    def _score(
        self, query: LayeredScan, place: LayeredScan, found: _FinePose
    ) -> float:
        config = self.config
        weights = np.array(config.weights)
        common = int(weights @ found.common)
        of_query = int(weights @ np.diff(query.starts)) + config.least_cells
        of_place = int(weights @ np.diff(place.starts)) + config.least_cells
        if of_query == 0 or of_place == 0:
            return 0.0
        return common / math.sqrt(of_query * of_place)


def _key(scan: LayeredScan) -> bytes:
    """Returns a hash of a scan, whose object may be read from a file again."""
    return hashlib.sha256(scan.cells.tobytes() + scan.starts.tobytes()).digest()


def _search(
    query: LayeredScan,
    database: LayeredDatabase,
    number: int,
    refined: int,
    exhaustive: bool = False,
) -> np.ndarray:
    """Searches for the places and poses at which coarse maps overlap most.

    The second search compares `number` pairs of a place and a heading, and the
    third search compares `refined` of these pairs. An exhaustive search keeps
    each place at its best heading.

    Args:
        exhaustive: whether each place is kept.

    Returns:
        (N, 4) int64: place, heading and shifts from which `climb` starts. The
        pairs with the greatest overlap, compared with chance, come first.
    """
    surprise, poses = _first_search(query, database)
    num_places, num_headings = surprise.shape
    if exhaustive:
        best = surprise.argmax(axis=1) + np.arange(num_places) * num_headings
        refined = len(best)
    else:
        best = _indices_of_greatest(surprise.ravel(), number)
    poses = poses[best] * _TO_SECOND
    maps = _maps_of_scan(query, _SECOND_TURNS, _SECOND_HALVINGS)
    for moves in (_SECOND_MOVES, _THIRD_MOVES):
        surprise, poses = _overlaps_beyond_chance(
            maps, database.second, _SECOND_WEIGHTS, poses, moves
        )
        poses = poses[_indices_of_greatest(surprise, refined)]
    # The best pose of each place, in the order of the places.
    _, first = np.unique(poses[:, 0], return_index=True)
    return poses[np.sort(first)] * _TO_LAST


def _first_search(
    query: LayeredScan, database: LayeredDatabase
) -> tuple[np.ndarray, np.ndarray]:
    """Compares a query with every place at every heading.

    Returns:
        (D, H) by how many standard deviations the overlap exceeds chance, less
        a share of the mean over the headings; (D H, 4) the best poses, place by
        place.
    """
    shape = len(database.places), len(_FIRST_TURNS)
    starts = np.zeros((math.prod(shape), 4), np.int64)
    starts[:, 0], starts[:, 1] = np.divmod(np.arange(len(starts)), shape[1])
    surprise, poses = _overlaps_beyond_chance(
        _maps_of_scan(query, _FIRST_TURNS, _FIRST_HALVINGS),
        database.first,
        _FIRST_WEIGHTS,
        starts,
        _FIRST_MOVES,
    )
    surprise = surprise.reshape(shape)
    surprise -= _MEAN_SHARE * surprise.mean(axis=1, keepdims=True)
    return surprise, poses


def _overlaps_beyond_chance(
    query: CoarseMaps,
    places: CoarseMaps,
    weights: np.ndarray,
    starts: np.ndarray,
    moves: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the best overlaps near some poses, compared with chance.

    Args:
        query: maps of the query, one for each heading.
        places: maps of the places.
        weights: (4,) weight of each of the four maps.
        starts: (N, 4) poses: place, heading and shifts.
        moves: moves of these poses that are tried, see `best_overlaps`.

    Returns:
        (N,) by how many standard deviations the overlap exceeds the overlap
        that is expected by chance; (N, 4) the best poses.
    """
    counts, found = best_overlaps(
        query.bits, places.bits, weights, starts, moves
    )
    place = starts[:, 0]
    product = query.counts[found[:, 0]] * places.counts[place]
    num_cells = query.bits.shape[2] ** 2
    # The variance is at least one, for maps without bits.
    deviation = np.sqrt(product @ weights**2 / num_cells + 1.0)
    surprise = (counts - product @ weights / num_cells) / deviation
    return surprise, np.column_stack([place, found])


def _maps_of_places(
    places: Sequence[LayeredScan], halvings: int, margin: int
) -> CoarseMaps:
    """Returns coarse maps of places at one heading, with a margin of rows.

    The heading is the heading of the recorded scan.
    """
    maps = [_maps_of_scan(place, turns(1), halvings) for place in places]
    bits = np.concatenate([of_place.bits for of_place in maps])
    return CoarseMaps(
        np.pad(bits, ((0, 0), (0, 0), (margin, margin))),
        np.concatenate([of_place.counts for of_place in maps]),
    )


def _maps_of_scan(
    scan: LayeredScan, at: np.ndarray, halvings: int
) -> CoarseMaps:
    """Returns coarse maps of a scan at some headings."""
    return CoarseMaps(
        *coarse_maps(scan.cells, scan.starts, at, halvings, _MAPS)
    )


def _indices_of_greatest(values: np.ndarray, number: int) -> np.ndarray:
    """Returns the indices of the greatest values (N,), decreasing.

    Equal values are in order of their indices. A partial sort alone would leave
    their order to the processor.
    """
    candidates = np.arange(len(values))
    if number < len(values):
        least = np.partition(values, -number)[-number]
        candidates = np.flatnonzero(values >= least)
    order = candidates[np.argsort(-values[candidates], kind="stable")]
    return order[:number]


def layer_cells(
    points: np.ndarray, sensor_height: float, cell: float, least_points: int
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the occupied cells of each layer of a scan.

    The layers are low, middle and high points, poles and kerbs.

    Args:
        points: (N, 3) in the frame of the LiDAR [m].
        sensor_height: height of the sensor above the ground [m].
        cell: length of a cell [m].
        least_points: number of points that fill a cell.

    Returns:
        (M,) uint16 numbers of the occupied cells, layer by layer, increasing in
        each layer; and (6,) int64, the index at which each layer begins and the
        last one ends. Rows are along x, columns along y; the sensor is in the
        middle.
    """
    # Sums, products, quotients and square roots are the same on every
    # processor: IEEE 754 defines them to the last bit.
    half = 0.5 * GRID * cell
    x, y, z = points.T
    is_inside = (-half <= x) & (x < half) & (-half <= y) & (y < half)
    x, y, z = points.compress(is_inside, axis=0).T
    # Rounding may reach the limit.
    row, column = (
        np.minimum(((along + half) / cell).astype(np.int64), GRID - 1)
        for along in (x, y)
    )
    number = row * GRID + column
    height = z - _ground_below(x, y, z, half, -sensor_height)
    layer = np.searchsorted(_HEIGHTS, height)
    counts = np.bincount(
        layer * GRID * GRID + number, minlength=4 * GRID * GRID
    )
    bottom, top = extremes(height, number, GRID * GRID)
    step = top - bottom
    is_kerb = (
        (top <= _HEIGHTS[0]) & (_KERB_STEP[0] <= step) & (step <= _KERB_STEP[1])
    )
    layers = [
        *map(np.flatnonzero, counts.reshape(4, -1)[1:] >= least_points),
        _poles(top.reshape(GRID, GRID) >= _POLE_TOP),
        np.flatnonzero(is_kerb),
    ]
    starts = np.cumsum([0, *map(len, layers)])
    return np.concatenate(layers).astype(np.uint16), starts


def _ground_below(
    x: np.ndarray, y: np.ndarray, z: np.ndarray, half: float, start: float
) -> np.ndarray:
    """Returns the height of the ground below each point (N,) [m].

    In each sector, the lowest points of successive rings give the height of the
    ground. The search begins at the sensor, below which the ground has the
    height `start`, and continues outwards up to a distance of `half` in x and y
    [m].
    """
    # Sectors divide the sides of a square evenly. Angles would need an arc
    # tangent, whose last bits differ between processors.
    length = np.abs(x) + np.abs(y)
    turn = y / np.where(length > 0.0, length, 1.0)
    turn = np.where(x < 0.0, 2.0 - turn, np.where(turn < 0.0, turn + 4.0, turn))
    sector = np.minimum((turn * (0.25 * _SECTORS)).astype(int), _SECTORS - 1)
    ring = (np.sqrt(x * x + y * y) / _RING).astype(int)
    num_rings = math.ceil(half * math.sqrt(2.0) / _RING) + 1
    lowest, _ = extremes(z, ring * _SECTORS + sector, num_rings * _SECTORS)
    lowest = lowest.reshape(num_rings, _SECTORS)
    height, last = np.full(_SECTORS, start), np.full(_SECTORS, -1)
    ground = np.empty_like(lowest)
    for number, here in enumerate(lowest):
        limit = _GROUND_STEP + _GROUND_SLOPE * _RING * (number - last)
        is_ground = np.abs(here - height) <= limit
        height = np.where(is_ground, here, height)
        last[is_ground] = number
        ground[number] = height
    return ground[ring, sector]


def _poles(is_tall: np.ndarray) -> np.ndarray:
    """Returns the numbers of the cells with poles: isolated tall cells.

    Args:
        is_tall: (GRID, GRID) bool.
    """
    row, column = np.nonzero(is_tall)
    windows = sliding_window_view(np.pad(is_tall, 3), (7, 7))
    around = windows[row, column]
    near = around[:, 2:5, 2:5].sum(axis=(1, 2))
    is_alone = (near <= _POLE_CELLS) & (near == around.sum(axis=(1, 2)))
    return (row * GRID + column)[is_alone]
