"""The stage of a scenario, with its passing changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.motion.trajectory import Trajectory
from cns_drake.roads.network import load_road_network
from cns_drake.scenarios.planning import plan_drive
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import map_folder, world_file
from cns_drake.scenarios.shipped import vehicle_file
from cns_drake.scene.world import World, load_world
from cns_drake.traffic.lane_file import read_lanes
from cns_drake.transient.changing import change_world

# Distance from the car's middle line to its sides, with a margin [m].
_HALF_WIDTH = 1.3


def load_stage(
    scenario: Scenario,
    *,
    with_vehicle: bool = True,
    trajectory: Trajectory | None = None,
) -> World:
    """Loads the stage of a scenario, with the vehicle in it.

    Args:
        scenario: names the stage and the passing changes.
        with_vehicle: whether the vehicle is there.
        trajectory: the drive, if already planned.

    Raises:
        InputError: the scenario's files cannot be used.
    """
    in_the_way = _in_the_way(scenario)
    world = load_world(
        world_file(scenario),
        vehicle=vehicle_file() if with_vehicle else None,
        without=(*scenario.without, *in_the_way),
    )
    if in_the_way:
        note = f"traffic: {len(in_the_way)} things in its lanes left out"
        world = replace(world, notes=(*world.notes, note))
    if scenario.transient.is_off:
        return world
    trajectory = trajectory or plan_drive(scenario)
    times = np.arange(0.0, trajectory.duration, 0.1)
    drive = shapely.LineString(trajectory.poses(times)[1][:, :2])
    return change_world(
        world, scenario.transient, drive, _driven(scenario, drive)
    )


def _in_the_way(scenario: Scenario) -> Sequence[str]:
    """Returns the names of what stands where the traffic drives."""
    if scenario.traffic.is_off or scenario.map is None:
        return ()
    folder = map_folder(scenario)
    if folder.roads.is_file() or not folder.lanes.is_file():
        return ()
    return read_lanes(folder.lanes).in_the_way


def _driven(scenario: Scenario, drive: shapely.LineString) -> BaseGeometry:
    """Returns the area where vehicles drive, seen from above [m]."""
    driven = drive.buffer(_HALF_WIDTH)
    roads = map_folder(scenario).roads
    if scenario.map is None or not roads.is_file():
        return driven
    return driven.union(load_road_network(roads).lane_area())
