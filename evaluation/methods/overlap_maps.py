"""Compares scans of layered overlap at different poses.

Part of layered overlap (see `evaluation.methods.layered_overlap`). All
arithmetic is in integers: sines and cosines are in units of 2^-14, positions in
half cells. Counts are therefore the same on every processor.

A cell is packed into 16 bits, see `layer_cells`: the upper byte is its row, the
lower byte its column. Its centre lies 2 * row + 1 - GRID and
2 * column + 1 - GRID half cells from the sensor, which is at the corner between
the four middle cells. In half cells, centres are therefore whole numbers.
"""

import math

import numpy as np

from cns_drake.base import compiled
from evaluation.methods.overlap_layers import GRID, NUM_LAYERS

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

    Args:
        number: H.

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
        (H, R, S) uint64, the R rows of the S maps at each heading; bit k of a
        row is set if column k is occupied. (H, S) int64, the number of occupied
        cells of each map.
    """
    rows = GRID >> halvings
    num_maps = maps.max() + 1
    bits = np.zeros((len(turns), rows, num_maps), np.uint64)
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
                    is_new = bits[heading, row, maps[layer]] & bit == 0
                    bits[heading, row, maps[layer]] |= bit
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
        queries: (H, R, S) uint64 maps of the query, at H headings that divide
            360 deg evenly.
        places: (D, R + 2 * margin, S) uint64 maps of the places, with `margin`
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
    num_headings, num_rows, num_maps = queries.shape
    margin = (places.shape[1] - num_rows) // 2
    size = num_rows * num_maps
    all_weights = np.empty(size, np.uint64)
    for i in range(size):
        all_weights[i] = np.uint64(weights[i % num_maps])
    query_words = queries.reshape(num_headings, size)
    place_words = places.reshape(len(places), -1)
    counts = np.full(len(starts), -1, np.int64)
    poses = np.zeros((len(starts), 3), np.int64)
    for n in range(len(starts)):
        for k in range(len(moves)):
            heading = (starts[n, 1] + moves[k, 0]) % num_headings
            right = starts[n, 2] + moves[k, 1]
            up = starts[n, 3] + moves[k, 2]
            if abs(right) > margin:
                continue
            to_right, to_left = np.uint64(max(-up, 0)), np.uint64(max(up, 0))
            first = (margin + right) * num_maps
            query = query_words[heading]
            place = place_words[starts[n, 0], first : first + size]
            total = np.uint64(0)
            for i in range(size):
                bits = (query[i] << to_left >> to_right) & place[i]
                # Bits are counted in pairs, nibbles, bytes, then all at once,
                # for which compilers have an instruction.
                bits -= (bits >> np.uint64(1)) & _EVERY_2ND
                bits = (bits & _PAIRS) + ((bits >> np.uint64(2)) & _PAIRS)
                bits = (bits + (bits >> np.uint64(4))) & _NIBBLES
                total += all_weights[i] * (bits * _BYTES >> np.uint64(56))
            if np.int64(total) > counts[n]:
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
