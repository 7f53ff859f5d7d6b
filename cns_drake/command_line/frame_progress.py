"""Progress of a simulation, in frames and simulated time."""

from __future__ import annotations

from collections.abc import Callable

from rich.progress import Progress, TaskID

from cns_drake.base.progress_bars import count_progress
from cns_drake.recording.frame_clock import FRAME_PERIOD


def frame_progress(
    progress: Progress, task: TaskID, period: float = FRAME_PERIOD
) -> Callable[[int, int], None]:
    """Returns a callback that shows the frames of a simulation.

    It is `count_progress` with simulated time and real-time factor.

    Args:
        progress: where to show it.
        task: as which task.
        period: time between frames [s].
    """

    def note(done: int, new: int, elapsed: float) -> str:
        factor = new * period / max(elapsed, 1e-9)
        simulated = done * period
        return f"{simulated:.1f} s simulated, {factor:.1f} x real time"

    return count_progress(progress, task, note)
