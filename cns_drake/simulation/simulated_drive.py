"""Drives for the evaluation that are simulated while it reads them.

Nothing is written: what would be recorded goes straight into maps and
descriptions, in about half the time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cns_drake.base import poses
from cns_drake.base.jobs.fingerprint import code_digest
from cns_drake.base.recordings.sequence import Sequence
from cns_drake.motion.sweep import Sweep
from cns_drake.motion.trajectory import pose_at
from cns_drake.recording.frame_clock import frame_stamp_ns
from cns_drake.recording.messages import MAP_FRAME, to_quat_xyzw
from cns_drake.scenarios.planning import count_frames, plan_drive
from cns_drake.scenarios.provenance import digest_inputs
from cns_drake.scenarios.rates import frame_period
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import (
    check_files,
    describe_scenario,
    world_file,
)
from cns_drake.scenarios.sensor_making import (
    make_measurement,
    make_pattern,
    sensor_pose,
)
from cns_drake.scene.world import load_world
from cns_drake.sensors.lidar import Lidar
from cns_drake.simulation.still_world import make_still_world


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
        """Returns scenario, and digests of all its files and of the code."""
        return {
            "simulated": self.scenario.model_dump(mode="json"),
            "inputs": digest_inputs(self.scenario),
            "code": code_digest(__name__),
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
        check_files(scenario)
        self.name = scenario.name
        self.world_frame = MAP_FRAME
        self._scenario = scenario
        self._period = frame_period(scenario.lidars)
        self._trajectory = plan_drive(scenario)
        self._num_frames = count_frames(scenario, self._trajectory)
        name, config = next(iter(scenario.lidars.items()))
        self._X_BS = sensor_pose(config)
        pattern = make_pattern(config)
        self._column_t = None
        if config.motion_distortion:
            self._column_t = pattern.column_t_ns * 1e-9
        measurement = make_measurement(config, name, scenario.seed)
        self._is_random = measurement.is_random
        # No LiDAR sees the vehicle that carries it.
        world = load_world(world_file(scenario), without=scenario.without)
        self._lidar = Lidar(
            world.scene_graph.world_frame_id(),
            RigidTransform(),
            pattern,
            measurement=measurement,
            with_sweep=True,
            structures=world.structures,
            anchored_frames=world.anchored_frames(),
        )
        self._diagram = make_still_world(world, self._lidar)
        self._context = self._diagram.CreateDefaultContext()

    def __len__(self) -> int:
        return self._num_frames

    @cached_property
    def stamps_ns(self) -> np.ndarray:
        stamps = [
            frame_stamp_ns(frame, period=self._period)
            for frame in range(len(self))
        ]
        return np.array(stamps, np.int64)

    @cached_property
    def X_WS(self) -> np.ndarray:
        quat_xyzw = [to_quat_xyzw(X_WB.rotation()) for X_WB in self._X_WBs]
        X_WB = poses.make_pose(
            poses.rotation_from_quaternion(np.array(quat_xyzw)),
            np.array([X_WB.translation() for X_WB in self._X_WBs]),
        )
        return X_WB @ self._X_BS.GetAsMatrix4()

    @cached_property
    def _X_WBs(self) -> list[RigidTransform]:
        times = self._period * np.arange(len(self))
        moments = self._trajectory.at(times)
        found = [pose_at(moments, frame) for frame in range(len(self))]
        # By way of quaternions, as a plant and a recording have it: to the
        # last bit, on which a voxel or a plane may depend.
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

    def scan(self, index: int) -> np.ndarray:
        context = self._lidar.GetMyMutableContextFromRoot(self._context)
        if self._is_random:
            # Only noise depends on the time as such; at a new one, the
            # SceneGraph computes everything anew.
            self._context.SetTime(index * self._period)
        self._lidar.GetInputPort("sweep").FixValue(context, self._sweep(index))
        return self._lidar.GetOutputPort("scan").Eval(context)

    def _sweep(self, index: int) -> Sweep:
        """Returns where the sensor is during a frame."""
        if self._column_t is not None:
            times = index * self._period + self._column_t
            return Sweep(*self._trajectory.poses(times)).of_frame(self._X_BS)
        X_WS = self._X_WBs[index] @ self._X_BS
        return Sweep(X_WS.rotation().matrix()[None], X_WS.translation()[None])
