"""A LiDAR that has all poses from an array does not ask the SceneGraph."""

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import (
    Capsule,
    GeometryInstance,
    PerceptionProperties,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from cns_drake.ray_casting import KnownPoses
from cns_drake.sensors import Lidar, connect_lidar, make_beam_pattern

INERTIA = SpatialInertia.SolidSphereWithMass(1.0, 1.0)
X_PS = RigidTransform(RollPitchYaw(0.1, -0.2, 0.4), [0.3, 0.1, 0.2])
NAMES = ("carrier", "capsule", "anchor")


class Scanned:
    """A LiDAR on a floating body, and three kinds of bodies that it sees.

    These are a floating body, one that is welded to the world, and one of a
    second plant that has nothing but poses.
    """

    def __init__(self, is_posed):
        builder = DiagramBuilder()
        scene_graph = builder.AddSystem(SceneGraph())
        plants = []
        for names in (NAMES, ("free",)):
            plant = builder.AddSystem(MultibodyPlant(0.0))
            source = plant.RegisterAsSourceForSceneGraph(scene_graph)
            for name in names:
                body = plant.AddRigidBody(name, INERTIA)
                shape = Capsule(0.4, 2.0) if name == "capsule" else Sphere(1.0)
                instance = GeometryInstance(
                    RigidTransform([0.2, 0.0, 0.1]), shape, name
                )
                instance.set_perception_properties(PerceptionProperties())
                frame = plant.GetBodyFrameIdOrThrow(body.index())
                scene_graph.RegisterGeometry(source, frame, instance)
            plants.append(plant)
        plant, other = plants
        anchor = plant.GetBodyByName("anchor")
        plant.WeldFrames(
            plant.world_frame(), anchor.body_frame(), RigidTransform([9, 0, 0])
        )
        for one in plants:
            one.Finalize()
        ids = {
            name: plant.GetBodyFrameIdOrThrow(plant.GetBodyByName(name).index())
            for name in NAMES
        }
        free = other.GetBodyByName("free")
        self.lidar = builder.AddSystem(
            Lidar(
                ids["carrier"],
                X_PS,
                make_beam_pattern("vlp-16", 0.1),
                anchored_frames=[ids["anchor"]],
            )
        )
        connect_lidar(builder, scene_graph, self.lidar)
        if not is_posed:
            for one in plants:
                builder.Connect(
                    one.get_geometry_pose_output_port(),
                    scene_graph.get_source_pose_port(one.get_source_id()),
                )
        self.plant = plant
        self.other = other
        self.free = free
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        self.is_posed = is_posed

    def scan(self, X_WP, X_WC, X_WF):
        for plant, body, X in (
            (self.plant, self.plant.GetBodyByName("carrier"), X_WP),
            (self.plant, self.plant.GetBodyByName("capsule"), X_WC),
            (self.other, self.free, X_WF),
        ):
            plant.SetFreeBodyPose(
                plant.GetMyMutableContextFromRoot(self.context), body, X
            )
        if self.is_posed:
            frames = {}
            X_WFs = []
            for plant in (self.plant, self.other):
                context = plant.GetMyContextFromRoot(self.context)
                for k in map(BodyIndex, range(1, plant.num_bodies())):
                    frames[plant.GetBodyFrameIdOrThrow(k)] = len(X_WFs)
                    X_WB = plant.EvalBodyPoseInWorld(context, plant.get_body(k))
                    X_WFs.append(X_WB.GetAsMatrix4())
            self.lidar.GetInputPort("frame_poses").FixValue(
                self.lidar.GetMyMutableContextFromRoot(self.context),
                Value(KnownPoses(frames, np.array(X_WFs))),
            )
        return self.lidar.GetOutputPort("scan").Eval(
            self.lidar.GetMyContextFromRoot(self.context)
        )


def test_scans_are_those_with_the_scene_graph_s_poses():
    """Bit by bit; without its inputs the SceneGraph has no poses at all."""
    rng = np.random.default_rng(4)
    posed, asking = Scanned(True), Scanned(False)
    seen = set()
    for _ in range(5):
        poses = [
            RigidTransform(
                RollPitchYaw(*rng.uniform(-0.5, 0.5, 3)),
                np.array(p) + rng.normal(size=3),
            )
            for p in ([0, 0, 0], [-6, 0, 0], [0, 7, 0])
        ]
        scan = posed.scan(*poses)
        assert scan.tobytes() == asking.scan(*poses).tobytes()
        seen |= set(scan["instance"].tolist())
    assert len(seen) == 3
