"""Finds obstacles beside the path of a drive by ray casting."""

import math

import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform
import shapely
from shapely import STRtree

from cns_drake.ray_casting.ray_casting_scene import RayCastingScene
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scene.perception_geometry import read_perception_geometry
from cns_drake.scene.world import load_world

# Heights above the path at which rays look for obstacles, from below the top of
# a kerb up to the car's roof [m].
_HEIGHTS = np.array([(0.0, 0.0, z) for z in (0.1, 0.3, 0.7, 1.2, 1.6)])
# Directions of these rays.
_AROUND = np.array(
    [
        (math.cos(angle), math.sin(angle), 0.0)
        for angle in np.radians(np.arange(0, 360, 10)).tolist()
    ]
)
# Range of these rays [m].
_SIGHT = 5.0
# Greatest z component of the normal of an obstacle.
_STEEP = 0.7


def obstacles_beside(scenario: Scenario, points: np.ndarray) -> STRtree:
    """Returns the points of obstacles beside a path in the world.

    Rays in all directions, from near the ground to the height of the car, find
    kerbs and walls. An edge at which the ground only falls is not found.

    Args:
        scenario: the scenario, whose world is loaded.
        points: (N, 3) points of the path, which must be close together [m].

    Returns:
        Points of the obstacles, seen from above.

    Raises:
        InputError: the world cannot be loaded.
    """
    world = load_world(scenario.world_file, without=scenario.without)
    context = world.plant.CreateDefaultContext()
    inspector = world.scene_graph.model_inspector()
    bodies = {
        frame: world.plant.GetBodyFromFrameId(frame)
        for frame in inspector.GetAllFrameIds()
        if frame != world.scene_graph.world_frame_id()
    }

    def X_WF(frame: FrameId) -> RigidTransform:
        if frame not in bodies:
            return RigidTransform()
        return bodies[frame].EvalPoseInWorld(context)

    scene = RayCastingScene(
        read_perception_geometry(inspector), world.anchored_frames(), X_WF
    )
    p_WR = (points + _HEIGHTS[:, None]).reshape(-1, 3)
    d_W = np.repeat(_AROUND, len(p_WR), axis=0)
    hits = scene.cast_rays(p_WR, d_W, _SIGHT, with_normals=True)
    # The ground is no obstacle.
    steep = np.isfinite(hits.ranges) & (np.abs(hits.normals_W[:, 2]) < _STEEP)
    p_WQ = np.tile(p_WR, (len(_AROUND), 1))[steep]
    p_WQ += hits.ranges[steep, None] * d_W[steep]
    # One point per centimetre is enough.
    xy = np.unique(np.round(p_WQ[:, :2], 2), axis=0)
    return STRtree(np.asarray(shapely.points(xy)))
