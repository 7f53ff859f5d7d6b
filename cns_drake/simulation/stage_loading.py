"""The world of a drive's stage, with its temporary changes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.base import doing
from cns_drake.scenarios import DrivePlan, ground_notes, vehicle_file
from cns_drake.scene import World, load_world
from cns_drake.transient import change_world

# Distance from the car's middle line to its sides, with a margin [m].
_HALF_WIDTH = 1.3


def load_stage(
    plan: DrivePlan, *, with_vehicle: bool = True, without: Sequence[str] = ()
) -> World:
    """Loads the world of a drive's stage, with its temporary changes.

    Args:
        plan: the plan of the drive. The temporary changes (field `transient`)
            are made near its path.
        with_vehicle: whether the world contains the vehicle.
        without: names of further structures that are left out.

    Raises:
        InputError: the scenario's files cannot be used.
    """
    scenario = plan.scenario
    doing("reading the stage")
    world = load_world(
        scenario.world_file,
        vehicle=vehicle_file() if with_vehicle else None,
        without=(*scenario.without, *without),
        model_paths=scenario.model_paths,
    )
    if scenario.world is not None:
        notes = ground_notes(scenario, plan.trajectory)
        world = replace(world, notes=(*world.notes, *notes))
    if scenario.transient.is_off:
        return world
    trajectory = plan.trajectory
    doing("making the temporary changes")
    times = np.arange(0.0, trajectory.duration, 0.1)
    drive = shapely.LineString(trajectory.poses(times)[1][:, :2])
    driven: BaseGeometry = drive.buffer(_HALF_WIDTH)
    if plan.network is not None:
        driven = driven.union(plan.network.areas.lane_area)
    return change_world(world, scenario.transient, drive, driven)
