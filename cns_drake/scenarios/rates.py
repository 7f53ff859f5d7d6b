"""Rates of sensors."""

from __future__ import annotations

from collections.abc import Mapping

from cns_drake.scenarios.lidar_config import LidarConfig

HIGHEST_RATE = 1000
_NS_PER_S = 1_000_000_000


def fastest_rate(lidars: Mapping[str, LidarConfig]) -> int:
    """Returns the turns per second of the fastest LiDAR."""
    return max(config.rate for config in lidars.values())


def frame_period(lidars: Mapping[str, LidarConfig]) -> float:
    """Returns the time between frames, the scans of the first LiDAR [s]."""
    return 1.0 / next(iter(lidars.values())).rate


def check_rate(rate: float, lowest: int, *, multiple_of: int = 1) -> None:
    """Checks that a rate of samples is possible.

    Stamps are whole nanoseconds, so the rate must divide a billion.

    Args:
        rate: samples per second.
        lowest: the lowest allowed rate; the highest is 1000.
        multiple_of: the rate must be a multiple of it.

    Raises:
        ValueError: it is not allowed; the message has the nearest allowed
            rates.
    """
    allowed = [
        one
        for one in range(lowest, HIGHEST_RATE + 1)
        if _NS_PER_S % one == 0 and one % multiple_of == 0
    ]
    if rate in allowed:
        return
    below = [one for one in allowed if one < rate][-1:]
    above = [one for one in allowed if one > rate][:1]
    kind = "a number"
    if multiple_of > 1:
        kind = f"a multiple of {multiple_of}"
    raise ValueError(
        f"rate: {rate:g} a second; it must be {kind} from"
        f" {lowest} to {HIGHEST_RATE} that divides 1,000,000,000 ns, such as"
        f" {' or '.join(map(str, below + above))}"
    )
