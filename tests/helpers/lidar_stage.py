"""A SceneGraph with a LiDAR in it, for tests."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import (
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    PerceptionProperties,
    SceneGraph,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.framework import DiagramBuilder

from cns_drake.sensors import (
    Lidar,
    SpinningPattern,
    connect_lidar,
    make_beam_pattern,
)

X_WS = RigidTransform(RollPitchYaw(0.11, -0.07, 2.3), [1.5, -0.8, 0.4])
# Rear, left, ahead, right.
FORWARD = SpinningPattern((0.0,), 4, 0.8, 120.0, 0.05)


class Stage:
    """A SceneGraph with world geometry and bodies that can be posed."""

    def __init__(self):
        self.builder = DiagramBuilder()
        self.scene_graph = self.builder.AddNamedSystem(
            "scene_graph", SceneGraph()
        )
        self.source = self.scene_graph.RegisterSource("stage")
        self.poses = {}

    def add(self, name, shape, X_FG=None, frame=None, color=None):
        instance = GeometryInstance(X_FG or RigidTransform(), shape, name)
        instance.set_perception_properties(PerceptionProperties())
        if frame is None:
            return self.scene_graph.RegisterAnchoredGeometry(
                self.source, instance
            )
        return self.scene_graph.RegisterGeometry(self.source, frame, instance)

    def add_frame(self, name, group, X_WF):
        frame = self.scene_graph.RegisterFrame(
            self.source, GeometryFrame(name, group)
        )
        self.poses[frame] = X_WF
        return frame

    def finish(self, parent=None, X_PS=X_WS, pattern=None, **kwargs):
        parent = parent or self.scene_graph.world_frame_id()
        pattern = pattern or make_beam_pattern("cns", 0.05)
        self.lidar = self.builder.AddNamedSystem(
            "lidar", Lidar(parent, X_PS, pattern, **kwargs)
        )
        connect_lidar(self.builder, self.scene_graph, self.lidar)
        self.diagram = self.builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        self.set_poses()
        return self

    def set_poses(self):
        if not self.poses:
            return
        vector = FramePoseVector()
        for frame, X_WF in self.poses.items():
            vector.set_value(frame, X_WF)
        self.scene_graph.get_source_pose_port(self.source).FixValue(
            self.scene_graph.GetMyMutableContextFromRoot(self.context),
            AbstractValue.Make(vector),
        )

    def add_to_context(self, frame, shape):
        instance = GeometryInstance(RigidTransform(), shape, "new")
        instance.set_perception_properties(PerceptionProperties())
        self.scene_graph.RegisterGeometry(
            self.scene_graph.GetMyMutableContextFromRoot(self.context),
            self.source,
            frame,
            instance,
        )

    def eval(self, port="scan"):
        context = self.lidar.GetMyContextFromRoot(self.context)
        return self.lidar.GetOutputPort(port).Eval(context)


def positions(scan):
    return np.stack([scan["x"], scan["y"], scan["z"]], axis=1).astype(float)


def beam_index(scan, pattern):
    column = np.round(
        scan["t"] / (pattern.period * 1e9 / pattern.num_columns)
    ).astype(int)
    return column * pattern.num_rings + scan["ring"]


def ahead(scan):
    """The range of the beam that points along x, None if it missed."""
    record = scan[scan["x"] > np.abs(scan["y"])]
    return float(record["x"][0]) if len(record) else None
