"""Times of a recording's frames and messages; each stream has its own rate."""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
import math

from cns_drake.base import NS_PER_S

# Time between frames [s] if the first LiDAR has the paper's rate, 20 Hz.
FRAME_PERIOD = 0.05
# Stamp of frame 0 [ns]. Zero would mean "latest" to tf2. The clock's time would
# give other bytes at each run.
START_NS = 1_700_000_000_000_000_000
# Largest denominator of a period in seconds: large enough to recover fractions
# such as 1/30 from a double.
_FINEST = 10**9


def frame_stamp_ns(frame: int, *, period: float = FRAME_PERIOD) -> int:
    """Returns the time stamp of a frame [ns].

    Args:
        frame: number of the frame, from 0.
        period: time between two frames [s].
    """
    return START_NS + round(frame * period * 1e9)


def frames_within(duration: float, period: float = FRAME_PERIOD) -> int:
    """Returns the number of frames of a drive, given its duration [s].

    The first frame is at the start of the drive.
    """
    return math.floor(duration / period) + 1


@dataclass(frozen=True)
class Schedule:
    """The times of several streams of messages, as ticks of one clock.

    Attributes:
        exact_period: time between ticks [s], as a fraction.
        steps: name of a stream -> number of ticks between two messages of the
            stream. The first message of every stream is due at tick 0.
        ends: name of a stream -> the last tick at which the stream can have a
            message. Streams without an entry have no end.
    """

    exact_period: Fraction
    steps: Mapping[str, int]
    ends: Mapping[str, int]

    @property
    def period(self) -> float:
        """Time between ticks [s]."""
        return float(self.exact_period)

    def due(self, tick: int) -> list[str]:
        """Returns the names of the streams that have a message at a tick."""
        return [
            name
            for name, step in self.steps.items()
            if tick % step == 0 and tick <= self.ends.get(name, tick)
        ]

    def time_ns(self, tick: int) -> int:
        """Returns the time of a tick since the start [ns]."""
        # Integer arithmetic: fractions would take longer than a message.
        numerator, denominator = self.exact_period.as_integer_ratio()
        doubled = 2 * tick * numerator * NS_PER_S + denominator
        return doubled // (2 * denominator)


def make_schedule(
    periods: Mapping[str, float], until: Mapping[str, float] | None = None
) -> Schedule:
    """Returns the schedule of streams, given the period of each stream.

    Args:
        periods: name of a stream -> time between two messages of the stream
            [s].
        until: name of a stream -> the time of the stream's last message [s].
    """
    exact = {
        name: Fraction(period).limit_denominator(_FINEST)
        for name, period in periods.items()
    }
    shared = math.lcm(*(own.denominator for own in exact.values()))
    ticks = math.gcd(*(int(own * shared) for own in exact.values()))
    period = Fraction(ticks, shared)
    return Schedule(
        period,
        {name: int(own / period) for name, own in exact.items()},
        {
            name: round(Fraction(time).limit_denominator(_FINEST) / period)
            for name, time in (until or {}).items()
        },
    )
