"""Counts of common bits of maps, for compiled functions.

All time of the coarse searches is spent here. Words are in lanes, eight side by
side, as processors take them, and are not counted one by one: adders of single
bits first sum them up, lane by lane and column by column (Harley and Seal's
method, in H. S. Warren, Hacker's Delight, section 5-1), which leaves a sixth of
the counts. A compiler finds neither by itself, so that both are given to it in
its own language.
"""

from __future__ import annotations

from collections.abc import Callable
import functools
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from evaluation.methods.llvm_vectors import (
    array_data,
    in_all_lanes,
    load_vector,
    store_vector,
)

LANES = 8
# The first search: rows of a map, a word a row, and the weights of the
# common bits of its maps, as powers of two; then those of the second.
FIRST_ROWS, FIRST_POWERS = 32, (0, 1)
SECOND_ROWS, SECOND_POWERS = 64, (0, 0, 2, 1)

_LONG = ir.IntType(64)
_LANES = ir.VectorType(_LONG, LANES)


def _common_of_places(
    typing_context: Any,
    queries: Any,
    query: Any,
    places: Any,
    place: Any,
    map_words: Any,
    counts: Any,
) -> Any:
    """Counts weighted common bits of a query and of LANES places.

    Args:
        typing_context: left to the compiler.
        queries: (N,) uint64, contiguous: maps, row by row.
        query: int64, where the query begins among them.
        places: (M,) uint64, contiguous: maps, row by row, LANES places each.
        place: int64, where the rows begin that the query's are laid over.
        map_words: int64, how far maps of a place are apart.
        counts: (LANES,) int64, contiguous, for the result.
    """
    del typing_context

    def generate(
        context: Any, builder: Any, signature: Any, values: Any
    ) -> Any:
        array = _arrays(context, builder, signature, values)
        adders = _Adders(builder)
        for row in range(FIRST_ROWS):
            for one, power in enumerate(FIRST_POWERS):
                at = _sum(builder, values[1], one * FIRST_ROWS + row)
                word = builder.load(builder.gep(array(0), [at]))
                at = _sum(
                    builder,
                    values[3],
                    row * LANES,
                    builder.mul(values[4], ir.Constant(_LONG, one)),
                )
                adders.add(
                    power,
                    builder.and_(
                        in_all_lanes(builder, word, _LANES),
                        load_vector(builder, array(2), at, _LANES),
                    ),
                )
        start = ir.Constant(_LONG, 0)
        store_vector(builder, array(5), start, adders.total())
        return context.get_dummy_value()

    signature = types.void(queries, query, places, place, map_words, counts)
    return signature, generate


def _common_of_rows(
    typing_context: Any,
    queries: Any,
    query: Any,
    left: Any,
    right: Any,
    places: Any,
    place: Any,
    map_words: Any,
) -> Any:
    """Returns how many weighted bits a query and a place have in common.

    Args:
        typing_context: left to the compiler.
        queries: (N,) uint64, contiguous: maps, row by row.
        query: int64, where the query begins among them.
        left: uint64, by how much its words are shifted to the left ...
        right: uint64, ... and then to the right.
        places: (M,) uint64, contiguous: maps, row by row.
        place: int64, where the rows begin that the query's are laid over.
        map_words: int64, how far maps of a place are apart.
    """
    del typing_context

    def generate(
        context: Any, builder: Any, signature: Any, values: Any
    ) -> Any:
        array = _arrays(context, builder, signature, values)
        adders = _Adders(builder)
        lefts = in_all_lanes(builder, values[2], _LANES)
        rights = in_all_lanes(builder, values[3], _LANES)
        for row in range(0, SECOND_ROWS, LANES):
            for one, power in enumerate(SECOND_POWERS):
                at = _sum(builder, values[1], one * SECOND_ROWS + row)
                words = load_vector(builder, array(0), at, _LANES)
                words = builder.lshr(builder.shl(words, lefts), rights)
                at = _sum(
                    builder,
                    values[5],
                    row,
                    builder.mul(values[6], ir.Constant(_LONG, one)),
                )
                adders.add(
                    power,
                    builder.and_(
                        words, load_vector(builder, array(4), at, _LANES)
                    ),
                )
        total = adders.total()
        lanes = [
            builder.extract_element(total, ir.Constant(ir.IntType(32), lane))
            for lane in range(LANES)
        ]
        return _sum(builder, *lanes)

    signature = types.int64(
        queries, query, left, right, places, place, map_words
    )
    return signature, generate


common_of_places: Callable[..., None] = intrinsic(_common_of_places)
common_of_rows: Callable[..., int] = intrinsic(_common_of_rows)


class _Adders:
    """Sums up the bits of words, in each lane and column by itself."""

    def __init__(self, builder: Any):
        self._builder = builder
        # Power of two -> at most two vectors whose bits count that much.
        self._words: dict[int, list[Any]] = {}

    def add(self, power: int, words: Any) -> None:
        """Adds bits that count 2^power each."""
        waiting = self._words.setdefault(power, [])
        waiting.append(words)
        if len(waiting) < 3:
            return
        build = self._builder
        a, b, c = waiting
        either = build.xor(a, b)
        self._words[power] = [build.xor(either, c)]
        self.add(power + 1, build.or_(build.and_(a, b), build.and_(either, c)))

    def total(self) -> Any:
        """Returns the vector of the lanes' sums."""
        build = self._builder
        population = cgutils.get_or_insert_function(
            build.module,
            ir.FunctionType(_LANES, [_LANES]),
            f"llvm.ctpop.v{LANES}i64",
        )
        total = ir.Constant(_LANES, [0] * LANES)
        for power, waiting in self._words.items():
            shift = ir.Constant(_LANES, [power] * LANES)
            for words in waiting:
                count = build.call(population, [words])
                total = build.add(total, build.shl(count, shift))
        return total


def _arrays(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    """Returns what gives the pointer to the words of an argument."""
    return functools.partial(array_data, context, builder, signature, values)


def _sum(builder: Any, first: Any, *others: Any) -> Any:
    """Returns the sum of integers, of which some are known by now."""
    for other in others:
        if isinstance(other, int):
            other = ir.Constant(_LONG, other)
        first = builder.add(first, other)
    return first
