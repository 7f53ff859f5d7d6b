"""A drive that is read while it is recorded."""

from __future__ import annotations

import numpy as np
from pydrake.systems.analysis import Simulator

from cns_drake.scenarios.recording_schedule import (
    drive_schedule,
    first_points_topic,
)
from cns_drake.simulation.loaded_drive import LoadedDrive
from cns_drake.simulation.planned_drive import PlannedDrive


class DriveInProgress(PlannedDrive):
    """The scans of the first LiDAR, at the time of their recording.

    Reading a scan advances the simulation to its frame.
    """

    def __init__(self, drive: LoadedDrive, simulator: Simulator):
        """Takes the station of a drive before its first frame."""
        super().__init__(drive.scenario, drive.trajectory, drive.num_frames)
        self._simulator = simulator
        self._lidar = next(iter(drive.scenario.lidars))
        schedule = drive_schedule(drive.scenario)
        steps = schedule.steps[first_points_topic(drive.scenario)]
        self._frame_period = float(schedule.tick * steps)
        self._fault: BaseException | None = None

    def raise_fault(self) -> None:
        """Raises the simulation's exception, even if the reader caught it."""
        if self._fault is not None:
            raise self._fault

    def scan(self, index: int) -> np.ndarray:
        """Advances to a frame and returns its scan.

        Raises:
            ValueError: the simulation is beyond the frame, or the vehicle is
                not at its planned place.
        """
        simulator = self._simulator
        try:
            simulator.AdvanceTo(index * self._frame_period)
        except BaseException as error:
            self._fault = error
            raise
        context, diagram = simulator.get_context(), simulator.get_system()
        X_WB = diagram.GetOutputPort("odometry").Eval(context).X_WB
        if not X_WB.IsExactlyEqualTo(self.X_WBs[index]):
            raise ValueError(
                f"frame {index}: the vehicle is not at its planned place"
            )
        return diagram.GetOutputPort(f"{self._lidar}_scan").Eval(context)
