"""Adding traffic to a diagram."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake import geometry
from pydrake.geometry import FrameId, SceneGraph, SourceId
from pydrake.systems.framework import DiagramBuilder, System

from cns_drake.base.errors import InputError
from cns_drake.scene.labels import MAX_INSTANCE
from cns_drake.scene.structure_table import (
    StructureEntry,
    StructureTable,
)
from cns_drake.traffic.body_shapes import Limb, vehicle_limbs, walker_limbs
from cns_drake.traffic.traffic_motion import TrafficBody, TrafficMotion
from cns_drake.traffic.traffic_plan import TrafficPlan


def traffic_structures(plan: TrafficPlan, first: int = 1) -> StructureTable:
    """Returns name, instance id and class of all bodies in a plan.

    Raises:
        InputError: there are not enough ids.
    """
    names = [
        (f"traffic_{kind.name}_{k:03d}", kind.semantic_class)
        for k, kind in enumerate(plan.kinds, 1)
    ]
    num_walkers = plan.walkers.values.shape[1]
    names += [(f"walker_{k:03d}", "person") for k in range(1, num_walkers + 1)]
    if first + len(names) - 1 > MAX_INSTANCE:
        raise InputError(
            f"traffic: {len(names)} bodies and {first - 1} structures are "
            f"more than instance ids can count ({MAX_INSTANCE})"
        )
    return StructureTable(
        StructureEntry(first + k, name, semantic_class)
        for k, (name, semantic_class) in enumerate(names)
    )


def make_traffic(
    scene_graph: SceneGraph,
    plan: TrafficPlan,
    *,
    seed: int = 0,
    structures: StructureTable | None = None,
    turn: float = 0.05,
    name: str = "traffic",
) -> TrafficMotion:
    """Adds vehicles and walkers to a SceneGraph; returns the moving system.

    Args:
        scene_graph: takes the geometry, on frames of a source of its own.
        seed: seed of colours and sizes.
        structures: has an instance id for each body; by default
            `traffic_structures` of the plan.
        turn: duration of a LiDAR's turn with motion distortion [s].
        name: that of the source.
    """
    if structures is None:
        structures = traffic_structures(plan)
    entries = [structures[entry.name] for entry in traffic_structures(plan)]
    source = scene_graph.RegisterSource(name)
    bodies = []
    for k, entry in enumerate(entries):
        rng = np.random.default_rng([seed, k])
        if k < len(plan.kinds):
            limbs = vehicle_limbs(plan.kinds[k], rng)
        else:
            limbs = walker_limbs(rng)
        frames = _register(scene_graph, source, entry.name, limbs)
        bodies.append(
            TrafficBody(
                entry.instance, entry.name, entry.semantic_class, limbs, frames
            )
        )
    return TrafficMotion(plan, bodies, source, turn)


def add_traffic(
    builder: DiagramBuilder,
    scene_graph: SceneGraph,
    plan: TrafficPlan,
    *,
    name: str = "traffic",
    **options: Any,
) -> TrafficMotion:
    """Adds vehicles and walkers to a diagram.

    Options are further arguments of `make_traffic`. The system has the name of
    the source of geometry, and its port `geometry_pose` is connected.

    Example:
        from cns_drake import add_traffic

        traffic = add_traffic(builder, scene_graph, plan)
    """
    traffic = make_traffic(scene_graph, plan, name=name, **options)
    builder.AddNamedSystem(name, traffic)
    builder.Connect(
        traffic.GetOutputPort("geometry_pose"),
        scene_graph.get_source_pose_port(traffic.source_id),
    )
    return traffic


def connect_traffic(
    builder: DiagramBuilder,
    traffic: TrafficMotion,
    lidar: System,
    goes_on: bool = False,
) -> None:
    """Connects traffic with a LiDAR, which labels moving bodies as moving.

    Its port `frame_poses` may be connected already. If traffic goes on during
    its turn, the LiDAR has the `moving_frames` of `traffic` as `moving_bodies`.
    """
    for name in ("moving_instances", "frame_poses", "body_spatial_velocities"):
        if goes_on or name != "body_spatial_velocities":
            port = lidar.GetInputPort(name)
            if not builder.IsConnectedOrExported(port):
                builder.Connect(traffic.GetOutputPort(name), port)


def _register(
    scene_graph: SceneGraph, source: SourceId, name: str, limbs: Sequence[Limb]
) -> tuple[FrameId, ...]:
    """Registers limbs; returns their frames."""
    frames = []
    for limb in limbs:
        frame = geometry.GeometryFrame(f"{name}_{limb.name}")
        frames.append(scene_graph.RegisterFrame(source, frame))
        for one in limb.shapes:
            label = f"{name}/{limb.name}_{one.name}"
            number = scene_graph.RegisterGeometry(
                source,
                frames[-1],
                geometry.GeometryInstance(one.X_LS, one.shape, label),
            )
            for properties in (
                geometry.PerceptionProperties(),
                geometry.IllustrationProperties(),
            ):
                rgba = geometry.Rgba(*one.rgb, 1.0)
                properties.AddProperty("phong", "diffuse", rgba)
                scene_graph.AssignRole(source, number, properties)
    return tuple(frames)
