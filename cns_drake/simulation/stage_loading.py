"""The world of a drive's stage, with its temporary changes."""

from collections.abc import Sequence
from dataclasses import replace
import math

import numpy as np

from cns_drake.motion import vehicle_file
from cns_drake.scenarios import (
    DrivePlan,
    count_frames,
    ground_notes,
    load_scenario_world,
)
from cns_drake.scene import InSight, World
from cns_drake.sensors import make_lidar_model
from cns_drake.transient import change_world
from evaluation.base import doing
from worlds.shapes import Way

# Distance from the car's middle line to its sides, with a margin [m].
_HALF_WIDTH = 1.3
# How far the LiDARs are from the middle of the car at most, with a margin [m].
_FAR_MOUNT = 20.0
# A page shows what is this near to the drive: the whole of a shipped city [m].
_SURROUNDINGS = 750.0


def sight_along(plan: DrivePlan, *, with_page: bool) -> InSight | None:
    """Returns what tells what can be seen from a drive, or on its page.

    The result is None if more than the beams of the LiDARs asks for the world.

    Args:
        plan: the plan of the drive.
        with_page: whether the surroundings are shown on a page.

    Raises:
        InputError: the scenario cannot be run.
    """
    scenario = plan.scenario
    if not (
        scenario.traffic.is_off
        and scenario.transient.is_off
        and not (scenario.cameras or scenario.further_sensors)
        and not scenario.without
        and scenario.city.loses_nothing
    ):
        return None
    reach = _SURROUNDINGS if with_page else 0.0
    for name, config in scenario.lidars.items():
        model = make_lidar_model(config, name, scenario.seed, scenario.weather)
        measured = model.returns or model.measurement
        reach = max(reach, measured.reach(model.pattern.max_range))
    reach += math.hypot(scenario.offset.ahead, scenario.offset.left)
    frames = count_frames(scenario, plan.trajectory)
    times = np.arange(frames + 1) * scenario.frame_period
    way = Way(plan.trajectory.poses(times)[1][:, :2])
    return lambda boxes: way.is_near(boxes, reach + _FAR_MOUNT)


def load_stage(
    plan: DrivePlan,
    *,
    with_vehicle: bool = True,
    without: Sequence[str] = (),
    in_sight: InSight | None = None,
) -> World:
    """Loads the world of a drive's stage, with its temporary changes.

    Args:
        plan: the plan of the drive. The temporary changes (field `transient`)
            are made near its path.
        with_vehicle: whether the world contains the vehicle.
        without: names of further structures that are left out.
        in_sight: see `cns_drake.scene.world.load_world`.

    Raises:
        InputError: the scenario's files cannot be used.
    """
    scenario = plan.scenario
    doing("reading the stage")
    world = load_scenario_world(
        scenario,
        without,
        vehicle=vehicle_file() if with_vehicle else None,
        in_sight=in_sight,
    )
    if scenario.world is not None:
        notes = ground_notes(scenario, plan.trajectory)
        world = replace(world, notes=(*world.notes, *notes))
    if scenario.transient.is_off:
        return world
    trajectory = plan.trajectory
    doing("making the temporary changes")
    times = np.arange(0.0, trajectory.duration, 0.1)
    drive = Way(trajectory.poses(times)[1][:, :2])
    driven = drive.area(_HALF_WIDTH)
    if plan.network is not None:
        driven = driven.union(plan.network.areas.lane_area)
    return change_world(world, scenario.transient, drive, driven)
