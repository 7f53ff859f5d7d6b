"""When events of Drake run, and the whole nanoseconds of their times."""

import math

from evaluation.base import NS_PER_S


def shortly_before(time: float, times: int = 1) -> float:
    """Returns a time [s] `times` x 16 roundings earlier, for an event of Drake.

    Drake runs publish events before the updates of the same time; and of two
    equal times that are computed as offset + k * period with other periods,
    either can be the earlier one. An event shortly before its time sees the
    state that a plant with a step has at this time, and whatever runs at this
    time sees what the event did.
    """
    return time * (1.0 - times * 2.0**-48)


def starts_late(
    start: float, period: float, offset: float, times: int = 1
) -> bool:
    """Returns whether a simulation misses an event at the time of its start.

    Args:
        start: time of the start [s].
        period: time between two events [s].
        offset: time of the first event [s].
        times: the number that was given to `shortly_before`.
    """
    number = max(0, math.floor((start - offset) / period + 0.5))
    due = offset + number * period
    is_due = nearest_ns(due) == nearest_ns(start)
    return is_due and shortly_before(due, times) < start


def nearest_ns(time: float, times: int = 0) -> int:
    """Returns a time [s] as the nearest whole number of nanoseconds.

    Args:
        time: the time, or that of an event `shortly_before` it.
        times: the number that was given to `shortly_before`; 0 for the time.
    """
    return math.floor(time / (1.0 - times * 2.0**-48) * NS_PER_S + 0.5)
