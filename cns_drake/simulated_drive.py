"""Drives for the evaluation that are simulated while it reads them.

Nothing is written: what would be recorded goes straight into maps and
descriptions, in about half the time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydrake.math import RotationMatrix

from cns_drake import __version__
from cns_drake.frame_clock import FRAME_PERIOD, frame_stamp_ns
from cns_drake.messages import MAP_FRAME, to_quat_xyzw
from cns_drake.planning import count_frames, plan_drive
from cns_drake.provenance import combined_digest, digest_inputs
from cns_drake.scenario import Scenario
from cns_drake.station import make_station
from cns_drake.trajectory import pose_at
from evaluation import poses
from evaluation.sequences import Sequence


@dataclass(frozen=True)
class SimulatedDrive:
    """Opens a scenario's drive, as seen by its first LiDAR.

    Attributes:
        scenario: what to simulate.
    """

    scenario: Scenario

    def __call__(self) -> SimulatedSequence:
        return SimulatedSequence(self.scenario)

    def identity(self) -> dict:
        """Returns scenario, the digest of all its files, and the version."""
        return {
            "simulated": self.scenario.model_dump(mode="json"),
            "inputs": combined_digest(digest_inputs(self.scenario)),
            "version": __version__,
        }


class SimulatedSequence(Sequence):
    """The scans that a recording of a scenario would hold.

    A scan is simulated whenever it is asked for.
    """

    def __init__(self, scenario: Scenario):
        """Loads the stage and plans the drive.

        Raises:
            InputError: the scenario cannot be run.
        """
        scenario.check_files()
        self.name = scenario.name
        self.world_frame = MAP_FRAME
        self._scenario = scenario
        self._trajectory = plan_drive(scenario)
        self._num_frames = count_frames(scenario, self._trajectory)
        name, lidar = next(iter(scenario.lidars.items()))
        self._X_BS = lidar.pose().GetAsMatrix4()
        self._station = make_station(scenario, trajectory=self._trajectory)
        self._context = self._station.CreateDefaultContext()
        self._scan = self._station.GetOutputPort(f"{name}_scan")

    def __len__(self) -> int:
        return self._num_frames

    @cached_property
    def stamps_ns(self) -> np.ndarray:
        stamps = [frame_stamp_ns(frame) for frame in range(len(self))]
        return np.array(stamps, np.int64)

    @cached_property
    def X_WS(self) -> np.ndarray:
        moments = self._trajectory.at(FRAME_PERIOD * np.arange(len(self)))
        X_WBs = [pose_at(moments, frame) for frame in range(len(self))]
        # By way of quaternions, as a plant and a recording have it: to the
        # last bit, on which a voxel or a plane may depend.
        R_WBs = [RotationMatrix(X.rotation().ToQuaternion()) for X in X_WBs]
        quat_xyzw = np.array([to_quat_xyzw(R_WB) for R_WB in R_WBs])
        X_WB = poses.make_pose(
            poses.rotation_from_quaternion(quat_xyzw),
            np.array([X.translation() for X in X_WBs]),
        )
        return X_WB @ self._X_BS

    @property
    def scenario(self) -> Mapping:
        return self._scenario.model_dump(mode="json", exclude_none=True)

    def scan(self, index: int) -> np.ndarray:
        self._context.SetTime(index * FRAME_PERIOD)
        return self._scan.Eval(self._context)
