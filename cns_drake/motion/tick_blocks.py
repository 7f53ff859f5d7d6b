"""Values at evenly spaced times, many of which are computed at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np


class TickBlocks:
    """Computes what depends on time alone; it keeps the last block of times.

    NumPy takes hardly longer for a few times than for one. At other times
    than multiples of the period, values are computed on their own.
    """

    def __init__(
        self,
        compute: Callable[[np.ndarray], Sequence[np.ndarray]],
        period: float | None,
        size: int,
    ):
        """Computes nothing yet.

        Args:
            compute: takes (T,) times [s]; returns arrays whose first dimension
                is T. A row must depend on its own time alone.
            period: distance of the times [s]; None if they are uneven.
            size: number of times of a block.
        """
        self._compute = compute
        self._period = period
        self._size = size
        # The last block, and its number.
        self._block: tuple[int, Sequence[np.ndarray]] | None = None

    def at(self, time: float) -> tuple[np.ndarray, ...]:
        """Returns the rows of a time [s]."""
        tick = 0 if self._period is None else round(time / self._period)
        if self._period is None or tick * self._period != time:
            values, row = self._compute(np.array([time])), 0
        else:
            number, row = divmod(tick, self._size)
            if self._block is None or self._block[0] != number:
                ticks = number * self._size + np.arange(self._size)
                self._block = number, self._compute(ticks * self._period)
            values = self._block[1]
        return tuple(value[row] for value in values)
