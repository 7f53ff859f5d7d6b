"""Times of frames."""

import math

# Time between frames [s], unless a LiDAR turns more slowly: the paper's 20 Hz.
FRAME_PERIOD = 0.05
# Stamp of frame 0 [ns]. Zero would mean "latest" to tf2. The clock's time would
# give other bytes at each run.
START_NS = 1_700_000_000_000_000_000


def frame_stamp_ns(
    frame: int, *, start_ns: int = START_NS, period: float = FRAME_PERIOD
) -> int:
    """Returns the stamp of a frame [ns]."""
    return start_ns + round(frame * period * 1e9)


def frames_within(duration: float, period: float = FRAME_PERIOD) -> int:
    """Returns the number of frames of a drive.

    The first frame is taken at its start.

    Args:
        duration: of the drive [s].
        period: time between frames [s].
    """
    return math.floor(duration / period) + 1
