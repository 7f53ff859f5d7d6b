"""Times of a recording's messages; each stream has its own rate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
import math

_NS_PER_S = 1_000_000_000
# Finer than any clock: a period such as 1/30 s is found again in a double.
_FINEST = 10**9


@dataclass(frozen=True)
class Schedule:
    """A clock of even ticks, and the ticks of each stream.

    Attributes:
        tick: time between ticks [s].
        steps: name of a stream -> ticks from one of its messages to the next.
            All are due at tick 0.
        ends: name of a stream -> the last tick at which it may be due; other
            streams have no end.
    """

    tick: Fraction
    steps: Mapping[str, int]
    ends: Mapping[str, int]

    @property
    def period(self) -> float:
        """Time between ticks [s]."""
        return float(self.tick)

    def due(self, tick: int) -> list[str]:
        """Returns the names of the streams that are due at a tick."""
        return [
            name
            for name, step in self.steps.items()
            if tick % step == 0 and tick <= self.ends.get(name, tick)
        ]

    def time_ns(self, tick: int) -> int:
        """Returns the time of a tick since the start [ns]."""
        # Integer arithmetic: fractions would take longer than a message.
        numerator, denominator = self.tick.as_integer_ratio()
        doubled = 2 * tick * numerator * _NS_PER_S + denominator
        return doubled // (2 * denominator)


def make_schedule(
    periods: Mapping[str, float], until: Mapping[str, float] | None = None
) -> Schedule:
    """Returns the schedule of streams with periods of their own.

    Args:
        periods: name of a stream -> time between its messages [s].
        until: name of a stream -> the time of its last message [s].
    """
    exact = {
        name: Fraction(period).limit_denominator(_FINEST)
        for name, period in periods.items()
    }
    shared = math.lcm(*(period.denominator for period in exact.values()))
    ticks = math.gcd(*(int(period * shared) for period in exact.values()))
    tick = Fraction(ticks, shared)
    return Schedule(
        tick,
        {name: int(period / tick) for name, period in exact.items()},
        {
            name: round(Fraction(time).limit_denominator(_FINEST) / tick)
            for name, time in (until or {}).items()
        },
    )
