"""What the benchmarks of ray casting share: stages, poses, timing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import time

import numpy as np
from pydrake.math import RigidTransform

from cns_drake.perception_geometry import (
    PerceptionGeometry,
    read_perception_geometry,
)
from cns_drake.planning import plan_drive
from cns_drake.scenario import load_scenario
from cns_drake.world import load_world


def read_stage(sequence: str) -> list[PerceptionGeometry]:
    """Returns the geometry of a sequence's stage."""
    world = load_world(load_scenario(sequence).world_file)
    return read_perception_geometry(world.scene_graph.model_inspector())


def sensor_poses(sequence: str, count: int) -> list[RigidTransform]:
    """Returns poses X_WS of the LiDAR, evenly spread over a drive."""
    trajectory = plan_drive(load_scenario(sequence))
    times = np.linspace(0.0, trajectory.duration, count)
    X_BS = RigidTransform([0.0, 0.0, 1.6])
    return [trajectory.pose(t) @ X_BS for t in times]


@dataclass(frozen=True)
class Spent:
    """Median times of a variant [s]: on the clock, and of all threads."""

    wall: float
    cpu: float


def interleaved(
    variants: dict[str, Callable[[], None]], rounds: int
) -> dict[str, Spent]:
    """Returns the median times of each variant.

    One round runs every variant once; each round starts with another one, so
    that whatever else the machine does meets all of them alike.
    """
    names = list(variants)
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in names}
    for variant in variants.values():
        variant()
    for k in range(rounds):
        for name in names[k % len(names) :] + names[: k % len(names)]:
            wall, cpu = time.perf_counter(), time.process_time()
            variants[name]()
            times[name].append(
                (time.perf_counter() - wall, time.process_time() - cpu)
            )
    return {
        name: Spent(*np.median(values, axis=0).tolist())
        for name, values in times.items()
    }
