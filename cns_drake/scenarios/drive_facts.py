"""Length, time and frames of a drive, without recording it."""

from __future__ import annotations

from dataclasses import dataclass

from cns_drake.recording.schedule import frames_within
from cns_drake.scenarios.planning import plan_drive
from cns_drake.scenarios.rates import frame_period
from cns_drake.scenarios.scenario import Scenario


@dataclass(frozen=True)
class DriveFacts:
    """Figures of a drive.

    Attributes:
        length: of the path [m].
        duration: from rest to rest [s].
        frames: number of frames: one at the start and one after each frame
            period, up to the end of the drive or to `scenario.frames`.
    """

    length: float
    duration: float
    frames: int


def drive_facts(scenario: Scenario) -> DriveFacts:
    """Plans the drive of a scenario and measures it.

    Raises:
        InputError: the drive cannot be planned; see `plan_drive`.
    """
    trajectory = plan_drive(scenario)
    frames = frames_within(trajectory.duration, frame_period(scenario.lidars))
    return DriveFacts(
        length=trajectory.length,
        duration=trajectory.duration,
        frames=min(frames, scenario.frames or frames),
    )
