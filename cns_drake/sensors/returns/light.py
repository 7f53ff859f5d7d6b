"""The light that comes back along the beams of a turn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled


class Light(NamedTuple):
    """N parts of the returning light, sorted by beam and distance.

    Attributes:
        beam: (N,) int32.
        distance: (N,) float64, from the time of flight [m].
        energy: (N,) float64: reflectivity, cosine of incidence, and the part of
            the beam that got there and back.
        geometry: (N,) int32 index of the reflecting geometry.
    """

    beam: np.ndarray
    distance: np.ndarray
    energy: np.ndarray
    geometry: np.ndarray

    @classmethod
    def room_for(cls, count: int) -> Light:
        """Returns parts to fill in."""
        return cls(
            np.empty(count, np.int32),
            np.empty(count),
            np.empty(count),
            np.empty(count, np.int32),
        )

    def first(self, count: int) -> Light:
        """Returns the first parts."""
        return Light(*(values[:count] for values in self))

    @classmethod
    def sorted(cls, parts: Sequence[Light]) -> Light:
        """Returns all parts in order."""
        unsorted = cls(
            *(np.concatenate(values) for values in zip(*parts, strict=True))
        )
        order = np.zeros(len(unsorted.beam), np.int64)
        _sort(unsorted.beam, unsorted.distance, order)
        return cls(*(values[order] for values in unsorted))


@compiled
def _sort(beam: np.ndarray, distance: np.ndarray, order: np.ndarray) -> None:
    """Fills in the order by beam and distance; equal ones keep theirs."""
    if not len(beam):
        return
    begin = np.zeros(beam.max() + 2, np.int64)
    for one in beam:
        begin[one + 1] += 1
    begin = np.cumsum(begin)
    size = np.zeros(len(begin), np.int64)
    for i in range(len(beam)):
        # The few parts of a beam are sorted by insertion.
        place = begin[beam[i]] + size[beam[i]]
        size[beam[i]] += 1
        while (
            place > begin[beam[i]] and distance[order[place - 1]] > distance[i]
        ):
            order[place] = order[place - 1]
            place -= 1
        order[place] = i
