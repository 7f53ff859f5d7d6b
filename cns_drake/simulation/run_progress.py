"""The progress of a run, and its result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math
from pathlib import Path

# Reports how many frames of how many are done.
ProgressCallback = Callable[[int, int], None]
# Receives a message for the user.
NoteCallback = Callable[[str], None]


@dataclass(frozen=True)
class Run:
    """The result of a simulation.

    Attributes:
        name: of the drive.
        folder: the recording.
        num_frames: frames in the recording.
        resumed_frames: number of them that an interrupted run had recorded.
        simulated_s: simulated time from the first frame simulated to the
            last [s].
        wall_s: wall time of the simulation, without loading [s].
        loading_s: time to load the stage and plan the drive [s].

    Example:
        from cns_drake import load_scenario, simulate

        run = simulate(load_scenario("downtown_01"), output)
        print(run.folder, run.real_time_factor)
    """

    name: str
    folder: Path
    num_frames: int
    resumed_frames: int
    simulated_s: float
    wall_s: float
    loading_s: float

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds per second."""
        return self.simulated_s / self.wall_s if self.wall_s > 0 else math.inf
