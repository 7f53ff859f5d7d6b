"""Maps of bits: drawn from cells, turned and shifted.

All is integer arithmetic: turns are by sines and cosines in units of 2^-14,
positions in half cells. Counts are the same on every processor.
"""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
import numpy as np

from cns_drake.base.compiled import compiled
from evaluation.methods.llvm_vectors import array_data
from evaluation.methods.overlap_layers import GRID, NUM_LAYERS

# Bits of a word.
WORD = 64
# The unit of sines and cosines is 2 to minus this power.
UNIT_BITS = 14


def _population(typing_context: Any, word: Any) -> Any:
    """Compiles the count of the bits of a uint64 to one instruction."""
    del typing_context, word

    def generate(
        context: Any, builder: Any, signature: Any, arguments: Any
    ) -> Any:
        del context, signature
        return builder.ctpop(arguments[0])

    return types.uint64(types.uint64), generate


# Returns how many bits of a word are set; for compiled functions only.
population: Callable[[np.uint64], np.uint64] = intrinsic(_population)


def _window(typing_context: Any, words: Any, byte: Any) -> Any:
    """Compiles the load of 64 bits that begin in the middle of a word."""
    del typing_context, byte

    def generate(
        context: Any, builder: Any, signature: Any, values: Any
    ) -> Any:
        data = array_data(context, builder, signature, values, 0)
        first = builder.bitcast(data, ir.IntType(8).as_pointer())
        place = builder.gep(first, [values[1]])
        word = builder.load(
            builder.bitcast(place, ir.IntType(WORD).as_pointer())
        )
        word.align = 1
        return word

    return types.uint64(words, types.intp), generate


# Returns the 64 bits from a byte of uint64 words on, of which a lower bit is in
# an earlier byte; for compiled functions only.
window: Callable[[np.ndarray, int], np.uint64] = intrinsic(_window)


def turns(number: int) -> np.ndarray:
    """Returns (H, 2) int64 cosines and sines of H equal steps of a turn."""
    unit = 1 << UNIT_BITS
    angles = [2.0 * math.pi * step / number for step in range(number)]
    return np.array(
        [(round(unit * math.cos(a)), round(unit * math.sin(a))) for a in angles]
    )


@compiled
def coarse_bits(
    cells: np.ndarray,
    starts: np.ndarray,
    turns: np.ndarray,
    halvings: int,
    maps: np.ndarray,
    halves: np.ndarray,
) -> np.ndarray:
    """Returns coarse maps of a scan, a word a row, at some headings.

    Args:
        cells: (M,) uint16, see `layer_cells`.
        starts: (layers + 1,) where layers begin.
        turns: (H, 2) int64 by which the cells are turned about the sensor.
        halvings: of the number of rows and columns.
        maps: (layers,) int64, in which map each layer is drawn.
        halves: (layers,) int64, in which half of the words; 0 where a map
            has all of them.

    Returns:
        (H, S, R) uint64, R rows of S maps.
    """
    rows = GRID >> halvings
    bits = np.zeros((len(turns), maps.max() + 1, rows), np.uint64)
    for heading in range(len(turns)):
        c, s = turns[heading]
        for layer in range(NUM_LAYERS):
            first = halves[layer] * (WORD // 2)
            for i in range(starts[layer], starts[layer + 1]):
                u = 2 * (np.int64(cells[i]) >> 8) + 1 - GRID
                v = 2 * (np.int64(cells[i]) & 255) + 1 - GRID
                x = c * u - s * v + (GRID << UNIT_BITS)
                y = s * u + c * v + (GRID << UNIT_BITS)
                row = x >> (UNIT_BITS + 1 + halvings)
                column = y >> (UNIT_BITS + 1 + halvings)
                if 0 <= row < rows and 0 <= column < rows:
                    bits[heading, maps[layer], row] |= np.uint64(
                        1
                    ) << np.uint64(column + first)
    return bits


def shifted_columns(bits: np.ndarray, reach: int) -> np.ndarray:
    """Returns maps whose words have two halves, shifted along the columns.

    Args:
        bits: (H, S, R) uint64.
        reach: C - 1 is twice this.

    Returns:
        (H, C, S, R) uint64, by -reach to reach; what leaves a half is lost.
    """
    half = (1 << (WORD // 2)) - 1
    ways = []
    for shift in range(-reach, reach + 1):
        kept = (half << shift) & half if shift > 0 else half >> -shift
        mask = np.uint64(kept | kept << (WORD // 2))
        distance = np.uint64(abs(shift))
        moved = bits << distance if shift > 0 else bits >> distance
        ways.append(moved & mask)
    return np.stack(ways, axis=1)


@compiled
def fine_bits(cells: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Returns a scan's layers, with the neighbours of all filled cells.

    Args:
        cells: (M,) uint16, see `layer_cells`.
        starts: (layers + 1,) where layers begin.

    Returns:
        (layers, GRID + 2, GRID / 64 + 2) uint64, a row and a word without bits
        on either side.
    """
    words = GRID // WORD
    one = np.uint64(1)
    wide = np.zeros((NUM_LAYERS, GRID + 2, words + 2), np.uint64)
    for layer in range(NUM_LAYERS):
        for i in range(starts[layer], starts[layer + 1]):
            row, column = int(cells[i]) >> 8, int(cells[i]) & 255
            for near in range(max(column - 1, 0), min(column + 2, GRID)):
                bit = one << np.uint64(near % WORD)
                wide[layer, row + 1, near // WORD + 1] |= bit
    result = np.zeros_like(wide)
    for layer in range(NUM_LAYERS):
        # Rows follow each other, so that one loop can pass over all of them.
        own, all_near = wide[layer].ravel(), result[layer].ravel()
        row = words + 2
        for i in range(row, (GRID + 1) * row):
            all_near[i] = own[i - row] | own[i] | own[i + row]
    return result


@compiled
def count_bits(bits: np.ndarray) -> np.ndarray:
    """Returns (N, S) int64, how many bits are set in maps (N, S, R)."""
    counts = np.zeros(bits.shape[:2], np.int64)
    for i in range(bits.shape[0]):
        for j in range(bits.shape[1]):
            for k in range(bits.shape[2]):
                counts[i, j] += np.int64(population(bits[i, j, k]))
    return counts
