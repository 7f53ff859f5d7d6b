"""Drives that are simulated while the evaluation reads them.

Nothing is written: scans go straight into maps and descriptions, in about half
the time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, FixedInputPortValue

from cns_drake.base.drives.drive import index_instances
from cns_drake.base.jobs.fingerprint import code_digest
from cns_drake.motion.sweep import Sweep
from cns_drake.ray_casting.ray_casting_scene import RayCastingScene
from cns_drake.scenarios.planning import count_frames, plan_drive
from cns_drake.scenarios.provenance import digest_inputs
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import check_files
from cns_drake.scenarios.sensor_making import (
    make_measurement,
    make_pattern,
    make_returns,
)
from cns_drake.sensors.beam_pattern import BeamPattern
from cns_drake.sensors.lidar import Lidar
from cns_drake.simulation.planned_drive import PlannedDrive
from cns_drake.simulation.scenario_traffic import (
    plan_scenario_traffic,
    with_traffic,
)
from cns_drake.simulation.stage_loading import load_stage
from cns_drake.simulation.still_world import make_still_world
from cns_drake.simulation.structure_list import structure_list
from cns_drake.traffic.traffic_adding import make_traffic


@dataclass(frozen=True)
class DriveSimulation:
    """Opens a scenario's drive, as seen by its first LiDAR.

    Attributes:
        scenario: the scenario to simulate.
    """

    scenario: Scenario

    def __call__(self) -> SimulatedDrive:
        return SimulatedDrive(self.scenario)

    def identity(self) -> dict:
        """Returns the scenario, and digests of its files and of the code."""
        return {
            "simulated": self.scenario.model_dump(mode="json"),
            "inputs": digest_inputs(self.scenario),
            "code": code_digest(__name__),
        }


class SimulatedDrive(PlannedDrive):
    """The scans of a scenario, as in its recording.

    A scan is simulated on each access.
    """

    def __init__(self, scenario: Scenario):
        """Loads the stage and plans the drive.

        Raises:
            InputError: the scenario cannot be run.
        """
        check_files(scenario)
        trajectory = plan_drive(scenario)
        num_frames = count_frames(scenario, trajectory)
        super().__init__(scenario, trajectory, num_frames)
        name, config = next(iter(scenario.lidars.items()))
        pattern = make_pattern(config)
        self._column_t = None
        if config.motion_distortion:
            self._column_t = pattern.column_t_ns * 1e-9
        measurement = make_measurement(config, name, scenario.seed)
        returns = make_returns(config, scenario.weather, name, scenario.seed)
        self._is_random = measurement.is_random or returns is not None
        # No LiDAR sees the vehicle that carries it.
        world = load_stage(scenario, with_vehicle=False, trajectory=trajectory)
        traffic = None
        if not scenario.traffic.is_off:
            plan = plan_scenario_traffic(scenario, trajectory)
            world = with_traffic(world, plan)
            traffic = make_traffic(
                world.scene_graph,
                plan,
                seed=scenario.traffic.seed,
                structures=world.structures,
                turn=self.period,
            )
        self._instances = index_instances(structure_list(world), self.name)
        self._has_traffic = traffic is not None
        distorts = self._column_t is not None
        self._lidar = Lidar(
            world.scene_graph.world_frame_id(),
            RigidTransform(),
            pattern,
            measurement=measurement,
            returns=returns,
            with_sweep=True,
            moving_bodies=(
                traffic.moving_frames if traffic and distorts else None
            ),
            posed_frames=traffic.moving_frames if traffic else None,
            structures=world.structures,
            anchored_frames=world.anchored_frames(),
        )
        self._diagram = make_still_world(world, self._lidar, traffic)
        self._context = self._diagram.CreateDefaultContext()
        self._lidar_context = self._lidar.GetMyMutableContextFromRoot(
            self._context
        )

    @property
    def instances(self) -> Mapping[int, Mapping]:
        return self._instances

    @property
    def pattern(self) -> BeamPattern:
        return self._lidar.pattern

    def scan(self, index: int) -> np.ndarray:
        context = self._place_lidar(index)
        return self._lidar.GetOutputPort("scan").Eval(context)

    def look(self, index: int) -> tuple[RayCastingScene, RigidTransform]:
        """Returns what a scan's sensor sees, and its pose X_WS at the stamp.

        The scene casts any rays, until the next scan or look moves it.

        Args:
            index: of the scan.
        """
        scene = self._lidar.EvalScene(self._place_lidar(index))
        return scene, self.X_WBs[index] @ self.X_BS

    def _place_lidar(self, index: int) -> Context:
        """Moves the LiDAR to a scan; returns its Context."""
        if self._is_random or self._has_traffic:
            # The time is set only for noise and traffic, which depend on it:
            # the SceneGraph computes everything anew at a new time.
            self._context.SetTime(index * self.period)
        # Unlike a new fixed value, it does not hold a copy.
        self._fixed_sweep.GetMutableData().set_value(self._sweep(index))
        return self._lidar_context

    @cached_property
    def _fixed_sweep(self) -> FixedInputPortValue:
        """The value of the LiDAR's port; notes each change."""
        port = self._lidar.GetInputPort("sweep")
        return port.FixValue(self._lidar_context, self._sweep(0))

    def _sweep(self, index: int) -> Sweep:
        """Returns the poses of the sensor during a frame."""
        if self._column_t is not None:
            times = index * self.period + self._column_t
            return Sweep(*self.trajectory.poses(times)).of_frame(self.X_BS)
        X_WS = self.X_WBs[index].multiply(self.X_BS)
        return Sweep(X_WS.rotation().matrix()[None], X_WS.translation()[None])
