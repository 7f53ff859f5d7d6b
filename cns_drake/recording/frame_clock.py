"""When frames are."""

import math

# Time between frames [s], unless a LiDAR turns slower: the paper's 20 Hz.
FRAME_PERIOD = 0.05
# Stamp of frame 0 [ns]. Not zero, which tf2 takes for "latest", and not the
# clock's time, so that the same scenario gives the same bytes.
START_NS = 1_700_000_000_000_000_000


def frame_stamp_ns(
    frame: int, *, start_ns: int = START_NS, period: float = FRAME_PERIOD
) -> int:
    """Returns the stamp of a frame [ns]."""
    return start_ns + round(frame * period * 1e9)


def frames_within(duration: float, period: float = FRAME_PERIOD) -> int:
    """Returns how many frames a drive has.

    The first frame is taken at its start.

    Args:
        duration: of the drive [s].
        period: time between frames [s].
    """
    return math.floor(duration / period) + 1
