"""A planned drive, without its scans."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cns_drake.base import poses
from cns_drake.base.drives.drive import Drive
from cns_drake.motion.trajectory import Trajectory, pose_at
from cns_drake.recording.messages import MAP_FRAME, to_quat_xyzw
from cns_drake.recording.schedule import frame_stamp_ns
from cns_drake.scenarios.rates import frame_period
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import describe_scenario
from cns_drake.scenarios.sensor_making import sensor_pose


class PlannedDrive(Drive):
    """The contents of a scenario's recording, except its scans.

    Attributes:
        trajectory: of the vehicle.
        period: between frames [s].
        X_BS: pose of the first LiDAR in base_link.
    """

    def __init__(
        self, scenario: Scenario, trajectory: Trajectory, num_frames: int
    ):
        self.name = scenario.name
        self.world_frame = MAP_FRAME
        self.trajectory = trajectory
        self.period = frame_period(scenario.lidars)
        self.X_BS = sensor_pose(next(iter(scenario.lidars.values())))
        self._scenario = scenario
        self._num_frames = num_frames

    def __len__(self) -> int:
        return self._num_frames

    @cached_property
    def stamps_ns(self) -> np.ndarray:
        stamps = [
            frame_stamp_ns(frame, period=self.period)
            for frame in range(len(self))
        ]
        return np.array(stamps, np.int64)

    @cached_property
    def X_WS(self) -> np.ndarray:
        quat_xyzw = [to_quat_xyzw(X_WB.rotation()) for X_WB in self.X_WBs]
        X_WB = poses.make_pose(
            poses.rotation_from_quaternion(np.array(quat_xyzw)),
            np.array([X_WB.translation() for X_WB in self.X_WBs]),
        )
        return X_WB @ self.X_BS.GetAsMatrix4()

    @cached_property
    def X_WBs(self) -> list[RigidTransform]:
        """Pose of base_link at each frame."""
        times = self.period * np.arange(len(self))
        moments = self.trajectory.at(times)
        found = [pose_at(moments, frame) for frame in range(len(self))]
        # Rotations pass through quaternions, as in a plant and a recording: the
        # last bit can decide on a voxel or a plane.
        return [
            RigidTransform(
                RotationMatrix(X_WB.rotation().ToQuaternion()),
                X_WB.translation(),
            )
            for X_WB in found
        ]

    @property
    def scenario(self) -> Mapping:
        return describe_scenario(self._scenario)
