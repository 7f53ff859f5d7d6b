"""A LiDAR with calibrated returns before surfaces of known reflectivity."""

from dataclasses import replace

import numpy as np
from pydrake.geometry import (
    Box,
    GeometryInstance,
    PerceptionProperties,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder

from cns_drake.sensors import (
    CalibratedReturns,
    DirectionPattern,
    Lidar,
    connect_lidar,
)
from evaluation.lidar_sheets import Response


def plate(name, reflectivity, X_WG, size=(0.1, 400.0, 400.0), shape=None):
    """Returns a plate, whose near face is the one at the lesser x."""
    instance = GeometryInstance(X_WG, shape or Box(*size), name)
    properties = PerceptionProperties()
    if reflectivity is not None:
        properties.AddProperty("lidar", "reflectivity", reflectivity)
    instance.set_perception_properties(properties)
    return instance


def facing(distance, offset=0.0):
    """Returns the pose of a plate with its near face at a distance ahead."""
    return RigidTransform([distance + 0.05, offset, 0.0])


def ahead(num_beams, spread=1e-4, max_range=400.0):
    """Returns beams along x, with a tiny spread, each of its own laser."""
    angle = np.linspace(-spread, spread, num_beams)
    d_Sset = np.stack(
        [np.cos(angle), np.sin(angle), np.zeros(num_beams)], axis=1
    )
    return DirectionPattern(
        d_Sset,
        min_range=0.3,
        max_range=max_range,
        period=0.05,
        rings=np.arange(num_beams) % 2**16,
    )


def beside(num_beams, angle):
    """Returns beams that go along x, each followed by one off by an angle.

    The turned beams have odd ring numbers.
    """
    angles = np.tile([0.0, angle], num_beams)
    d_Sset = np.stack(
        [np.cos(angles), np.sin(angles), np.zeros(2 * num_beams)], axis=1
    )
    rings = np.tile([0, 1], num_beams)
    return DirectionPattern(
        d_Sset, min_range=0.3, max_range=400.0, period=0.05, rings=rings
    )


def scan(instances, pattern, returns, frame=0, structures=None):
    """Returns the scan of a LiDAR in the world's origin."""
    builder = DiagramBuilder()
    scene_graph = builder.AddNamedSystem("scene_graph", SceneGraph())
    source = scene_graph.RegisterSource("plates")
    for instance in instances:
        scene_graph.RegisterAnchoredGeometry(source, instance)
    lidar = builder.AddNamedSystem(
        "lidar",
        Lidar(
            scene_graph.world_frame_id(),
            RigidTransform(),
            pattern,
            returns=returns,
            structures=structures,
        ),
    )
    connect_lidar(builder, scene_graph, lidar)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    context.SetTime(frame * pattern.period)
    return lidar.GetOutputPort("scan").Eval(lidar.GetMyContextFromRoot(context))


def unit(preset="os1-64", **options):
    """Returns the returns of a preset whose lasers are all alike."""
    returns = CalibratedReturns.of_preset(preset, **{"seed": 5, **options})
    even = Response(gain=0.0, speckle=0.0)
    sheet = returns.sheet.replaced(angle_error_deg=0.0, response=even)
    return replace(returns, sheet=sheet)
