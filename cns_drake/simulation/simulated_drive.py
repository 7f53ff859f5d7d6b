"""Drives that are simulated while the evaluation reads them.

No recording is written: scans are used directly to make maps and place
descriptors. This takes about half the time of recording a drive and then
reading the recording.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context

from cns_drake.motion import pose_at
from cns_drake.ray_casting import RayCastingScene
from cns_drake.recording import frame_stamp_ns, to_quat_xyzw
from cns_drake.scenarios import (
    SIMULATION_VERSION,
    DrivePlan,
    Scenario,
    describe_scenario,
    digest_inputs,
)
from cns_drake.scene import structures_in
from cns_drake.sensors import BeamPattern
from cns_drake.simulation.loaded_drive import load_drive
from cns_drake.simulation.station import make_station
from evaluation.base import doing, poses
from evaluation.drives import MAP_FRAME, Drive, index_instances


@dataclass(frozen=True)
class SimulationSource:
    """The source of a drive that is simulated when it is opened.

    Call the object to open the drive: `source()` returns a `SimulatedDrive`
    with the scans of the scenario's first LiDAR.

    Attributes:
        scenario: the scenario of the drive.
    """

    scenario: Scenario

    def __call__(self) -> SimulatedDrive:
        return SimulatedDrive(self.scenario)

    def identity(self) -> dict:
        """Returns everything on which the simulated scans depend, for JSON.

        The result contains the scenario, the digests of its files and the
        version of the simulation. Equal results mean equal scans.
        """
        return {
            "simulated": self.scenario.model_dump(mode="json"),
            "inputs": digest_inputs(self.scenario),
            "version": SIMULATION_VERSION,
        }


class SimulatedDrive(Drive):
    """A drive whose scans are simulated, and are the same as in a recording.

    Each access to a scan simulates the scan.

    Attributes:
        structures: names of all structures in the world.
        trajectory: planned motion of base_link.
        period: time between two frames [s].
    """

    def __init__(self, scenario: Scenario):
        """Loads the stage and plans the drive.

        Raises:
            InputError: the scenario cannot be run.
        """
        drive = load_drive(DrivePlan(scenario))
        world, trajectory = drive.world, drive.trajectory
        self.name = scenario.name
        self.world_frame = MAP_FRAME
        self.trajectory = trajectory
        self.period = scenario.frame_period
        self._X_BS = next(iter(drive.X_BSs.values()))
        self._scenario = scenario
        self._num_frames = drive.num_frames
        self._instances = index_instances(drive.structures, self.name)
        self.structures = structures_in(world)
        doing("building the diagram")
        self._diagram = make_station(drive)
        self._context = self._diagram.CreateDefaultContext()
        # The station would compute the vehicle's motion and its wheels; here
        # the motion is known beforehand.
        self._base = drive.base_link.index()
        frame_poses = self._diagram.GetSubsystemByName("frame_poses")
        context = frame_poses.GetMyMutableContextFromRoot(self._context)
        port = frame_poses.GetInputPort("body_poses")
        self._X_WBodies = list(port.Eval(context))
        self._fixed_poses = port.FixValue(
            context, AbstractValue.Make(self._X_WBodies)
        )
        self._lidar = self._diagram.GetSubsystemByName(
            next(iter(scenario.lidars))
        )

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
        return X_WB @ self.X_BS

    @property
    def X_BS(self) -> np.ndarray:
        return self._X_BS.GetAsMatrix4()

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

    @property
    def instances(self) -> Mapping[int, Mapping]:
        return self._instances

    @property
    def pattern(self) -> BeamPattern:
        """The beams of a revolution of the first LiDAR."""
        return self._lidar.pattern

    def scan(self, index: int) -> np.ndarray:
        return self._lidar.GetOutputPort("scan").Eval(self._context_at(index))

    def look(self, index: int) -> tuple[RayCastingScene, RigidTransform]:
        """Returns the world as a scene for ray casting, and the pose X_WS.

        Scene and pose are valid at the time stamp of scan `index`; X_WS is the
        pose of the LiDAR. The scene is valid until the next call of `look` or
        `scan`.
        """
        scene = self._lidar.EvalScene(self._context_at(index))
        return scene, self.X_WBs[index] @ self._X_BS

    def _context_at(self, index: int) -> Context:
        """Returns the LiDAR's Context at the time of a scan."""
        self._context.SetTime(index * self.period)
        self._X_WBodies[self._base] = self.X_WBs[index]
        self._fixed_poses.GetMutableData().set_value(self._X_WBodies)
        return self._lidar.GetMyContextFromRoot(self._context)
