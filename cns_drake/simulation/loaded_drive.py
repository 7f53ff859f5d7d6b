"""A scenario, loaded and ready for simulation."""

from __future__ import annotations

from dataclasses import dataclass

from pydrake.math import RigidTransform

from cns_drake.base.errors import InputError
from cns_drake.motion.trajectory import Trajectory
from cns_drake.recording.schedule import frames_within
from cns_drake.scenarios.planning import count_frames, plan_drive
from cns_drake.scenarios.provenance import (
    digest_inputs,
    recording_fingerprint,
)
from cns_drake.scenarios.rates import frame_period
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import (
    check_files,
)
from cns_drake.scenarios.sensor_making import sensor_pose
from cns_drake.scene.referenced_files import FileWatch
from cns_drake.scene.world import World
from cns_drake.simulation.scenario_traffic import (
    plan_scenario_traffic,
    with_traffic,
)
from cns_drake.simulation.stage_loading import load_stage
from cns_drake.traffic.traffic_plan import TrafficPlan


@dataclass(frozen=True)
class LoadedDrive:
    """A scenario with all inputs of its simulation.

    Attributes:
        scenario: with `frames` given.
        inputs: digests of its files.
        fingerprint: of the recording, for `fingerprint.txt`.
        trajectory: of the vehicle.
        world: the stage.
        num_frames: number of frames.
        traffic: other moving objects, if any.
    """

    scenario: Scenario
    inputs: dict[str, str]
    fingerprint: str
    trajectory: Trajectory
    world: World
    num_frames: int
    traffic: TrafficPlan | None = None

    @property
    def X_BSs(self) -> dict[str, RigidTransform]:
        """LiDAR name -> pose of the LiDAR in base_link."""
        lidars = self.scenario.lidars
        return {name: sensor_pose(lidar) for name, lidar in lidars.items()}


def load_drive(scenario: Scenario) -> LoadedDrive:
    """Plans the drive of a scenario and loads its stage.

    Raises:
        InputError: the scenario cannot be run, or its files changed while
            they were being read.
    """
    check_files(scenario)
    watch = FileWatch()
    inputs = digest_inputs(scenario, watch)
    trajectory = plan_drive(scenario)
    num_frames = count_frames(scenario, trajectory)
    scenario = scenario.model_copy(update={"frames": num_frames})
    world = load_stage(scenario, trajectory=trajectory)
    traffic = None
    if not scenario.traffic.is_off:
        traffic = plan_scenario_traffic(scenario, trajectory)
        world = with_traffic(world, traffic)
    changed = watch.changed()
    if changed is not None:
        raise InputError(f"{changed}: changed while it was being read")
    # `frames` is set for the whole drive as well, so that both are the same.
    whole = num_frames == frames_within(
        trajectory.duration, frame_period(scenario.lidars)
    )
    lines = [
        recording_fingerprint(scenario.model_copy(update=update), inputs)
        for update in ({}, {"frames": None})[: 1 + whole]
    ]
    return LoadedDrive(
        scenario,
        inputs,
        "\n".join(lines),
        trajectory,
        world,
        num_frames,
        traffic,
    )
