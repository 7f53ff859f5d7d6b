"""LiDARs in Diagrams with a MultibodyPlant: visible and hidden bodies."""

from helpers.lidar_stage import FORWARD, ahead
from helpers.plates import facing, plate
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import (
    Box,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    PerceptionProperties,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import FixedOffsetFrame, SpatialInertia
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource
import pytest

from cns_drake.sensors import (
    CalibratedReturns,
    MeasurementModel,
    add_lidar,
    make_beam_pattern,
)

INERTIA = SpatialInertia.SolidBoxWithDensity(1000.0, 1.0, 1.0, 1.0)


class Yard:
    """A plant of boxes ahead of a robot at the origin."""

    def __init__(self):
        self.builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(
            self.builder, 0.0
        )
        self.robot = self.add("robot", 0.0)

    def add(self, name, x, model=None):
        """Adds a cube of 1 m on a body of its own."""
        options = [] if model is None else [self.plant.AddModelInstance(model)]
        body = self.plant.AddRigidBody(name, *options, INERTIA)
        self.show(body, name)
        self.plant.SetDefaultFloatingBaseBodyPose(
            body, RigidTransform([x, 0, 0])
        )
        return body

    def show(self, body, name, x=0.0):
        grey = [0.5, 0.5, 0.5, 1.0]
        pose = RigidTransform([x, 0.0, 0.0])
        self.plant.RegisterVisualGeometry(body, pose, Box(1, 1, 1), name, grey)

    def weld(self, body, other, x):
        self.plant.WeldFrames(
            body.body_frame(), other.body_frame(), RigidTransform([x, 0, 0])
        )

    def ahead(self, place=None, **options):
        """The nearest range of a LiDAR in the robot's middle."""
        self.plant.Finalize()
        pattern = options.pop("pattern", FORWARD)
        lidar = add_lidar(
            self.builder,
            self.scene_graph,
            place or self.robot,
            RigidTransform(),
            pattern,
            **options,
        )
        context = self.builder.Build().CreateDefaultContext()
        return ahead(
            lidar.GetOutputPort("scan").Eval(
                lidar.GetMyContextFromRoot(context)
            )
        )


def test_bodies_of_the_default_model_are_seen():
    yard = Yard()
    yard.add("tower", 10.0)
    assert yard.ahead() == pytest.approx(9.5)


def test_bodies_welded_to_the_robot_are_not_seen():
    """This holds for bodies of any model, also if welded through others."""
    yard = Yard()
    arm, tower = yard.add("arm", 0.0), yard.add("tower", 10.0)
    mast = yard.add("mast", 0.0, "mast")
    assert tower.model_instance() == arm.model_instance()
    yard.weld(yard.robot, mast, 2.0)
    yard.weld(mast, arm, 2.0)
    assert yard.ahead() == pytest.approx(9.5)


def test_bodies_welded_to_the_world_are_seen_from_there():
    """The world is no part of a robot that is welded to it."""
    yard = Yard()
    yard.plant.WeldFrames(yard.plant.world_frame(), yard.robot.body_frame())
    pillar = yard.add("pillar", 0.0)
    yard.weld(yard.plant.world_body(), pillar, 10.0)
    assert yard.ahead() == pytest.approx(9.5)


def test_the_world_sees_everything():
    yard = Yard()
    yard.show(yard.plant.world_body(), "wall", 5.0)
    unmoved = yard.ahead(yard.plant.world_body(), pattern=make_near())
    assert unmoved == pytest.approx(0.5)


def test_hidden_bodies_can_be_chosen():
    yard = Yard()
    near, far = yard.add("near", 5.0), yard.add("far", 10.0)
    farther = yard.add("farther", 15.0)
    mast = yard.plant.AddFrame(
        FixedOffsetFrame("mast", farther, RigidTransform([0, 0, 9.0]))
    )
    yard.add("last", 20.0)
    frame = yard.plant.GetBodyFrameIdOrThrow(far.index())
    unseen = [yard.robot, near.body_frame(), frame, mast]
    assert yard.ahead(unseen=unseen) == pytest.approx(19.5)


def test_nothing_may_be_hidden():
    yard = Yard()
    yard.add("tower", 10.0)
    assert yard.ahead(unseen=[], pattern=make_near()) == pytest.approx(0.5)


def make_near():
    return make_beam_pattern("vlp-16", 0.05, num_columns=4, min_range=0.1)


def test_bodies_of_another_source():
    """The LiDAR's frame belongs to no plant; another such frame is visible."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    plant.Finalize()
    source = scene_graph.RegisterSource("puppets")
    frames = []
    poses = FramePoseVector()
    for name, x in (("mine", 3.0), ("other", 10.0)):
        frame = scene_graph.RegisterFrame(source, GeometryFrame(name))
        ball = GeometryInstance(RigidTransform(), Sphere(1.0), name)
        ball.set_perception_properties(PerceptionProperties())
        scene_graph.RegisterGeometry(source, frame, ball)
        poses.set_value(frame, RigidTransform([x, 0.0, 0.0]))
        frames.append(frame)
    puppeteer = builder.AddSystem(
        ConstantValueSource(AbstractValue.Make(poses))
    )
    builder.Connect(
        puppeteer.get_output_port(), scene_graph.get_source_pose_port(source)
    )
    lidar = add_lidar(
        builder, scene_graph, frames[0], RigidTransform(), FORWARD
    )
    context = builder.Build().CreateDefaultContext()
    scan = lidar.GetOutputPort("scan").Eval(lidar.GetMyContextFromRoot(context))
    assert ahead(scan) == pytest.approx(6.0)


def test_poses_and_points_in_the_world():
    yard = Yard()
    yard.show(yard.plant.world_body(), "wall", 8.0)
    yard.plant.Finalize()
    X_PS = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [0.4, 0.5, 0.6])
    lidar = add_lidar(
        yard.builder, yard.scene_graph, yard.robot, X_PS, "vlp-16"
    )
    context = yard.builder.Build().CreateDefaultContext()
    X_WB = RigidTransform(RollPitchYaw(-0.2, 0.1, -0.4), [2.0, -1.0, 0.3])
    yard.plant.SetFreeBodyPose(
        yard.plant.GetMyMutableContextFromRoot(context), yard.robot, X_WB
    )
    scan, cloud_S, cloud_W, X_WS = (
        lidar.GetOutputPort(name).Eval(lidar.GetMyContextFromRoot(context))
        for name in ("scan", "point_cloud_S", "point_cloud_W", "X_WS")
    )
    assert len(scan) > 20
    assert X_WS.IsNearlyEqualTo(X_WB @ X_PS, 1e-12)
    np.testing.assert_allclose(
        cloud_W.xyzs(), X_WS @ cloud_S.xyzs().astype(float), atol=1e-5
    )
    # On the faces of the wall, in the world.
    p_FR = np.abs(cloud_W.xyzs() - [[8.0], [0.0], [0.0]])
    np.testing.assert_allclose(p_FR.max(axis=0), 0.5, atol=1e-5)


def test_it_is_added_to_a_body_or_a_frame():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    body = plant.AddRigidBody(
        "robot",
        plant.AddModelInstance("robot"),
        SpatialInertia.SolidBoxWithDensity(1000.0, 1.0, 1.0, 1.0),
    )
    mast = plant.AddFrame(
        FixedOffsetFrame("mast", body, RigidTransform([1.0, 0.0, 0.0]))
    )
    plant.RegisterVisualGeometry(
        plant.world_body(),
        RigidTransform([8.0, 0.0, 0.0]),
        Box(2.0, 4.0, 4.0),
        "wall",
        [1.0, 1.0, 1.0, 1.0],
    )
    plant.Finalize()
    X_PS = RigidTransform([0.5, 0.0, 0.0])
    lidars = [
        add_lidar(builder, scene_graph, place, X_PS, pattern, name=name)
        for place, pattern, name in (
            (body, FORWARD, "on_body"),
            (mast, FORWARD, "on_mast"),
            (body, "vlp-16", "preset"),
        )
    ]
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    scans = [
        lidar.GetOutputPort("scan").Eval(lidar.GetMyContextFromRoot(context))
        for lidar in lidars
    ]
    # Embree's last bit is not the same on all processors.
    x = [float(scan["x"].item()) for scan in scans[:2]]
    assert x == pytest.approx([6.5, 5.5], abs=1e-6)
    assert lidars[2].pattern == make_beam_pattern("vlp-16", 0.05)
    # The LiDAR keeps the pose of the call.
    X_PS.set_translation([9.0, 0.0, 0.0])
    assert [one.X_PB.translation()[0] for one in lidars] == [0.5, 1.5, 0.5]
    np.testing.assert_allclose(scans[2]["x"], 6.5, rtol=1e-6)


@pytest.mark.parametrize(
    ("pattern", "options", "fault"),
    [
        (make_beam_pattern("vlp-16"), {"returns": "calibrated"}, "of a preset"),
        ("vlp-16", {"returns": "real", "seed": 1}, "'real': give 'ideal'"),
        ("vlp-16", {"returns": "calibrated", "dropout": 0.1}, "of their own"),
        (
            "vlp-16",
            {
                "returns": "calibrated",
                "measurement": MeasurementModel(faint_dropout=0.1),
            },
            "of their own",
        ),
        (
            "vlp-16",
            {"returns": CalibratedReturns.of_preset("vlp-16"), "seed": 1},
            "^seed: CalibratedReturns has its own",
        ),
    ],
)
def test_returns_that_cannot_be(pattern, options, fault):
    scene_graph = SceneGraph()
    place = None
    X_PS = RigidTransform()
    builder = DiagramBuilder()
    builder.AddSystem(scene_graph)
    place = scene_graph.world_frame_id()
    with pytest.raises(ValueError, match=fault):
        add_lidar(builder, scene_graph, place, X_PS, pattern, **options)


def facing_wall(preset, **options):
    """Returns a builder, and a LiDAR in it, 9 m from a wall."""
    builder = DiagramBuilder()
    scene_graph = builder.AddSystem(SceneGraph())
    source = scene_graph.RegisterSource("wall")
    scene_graph.RegisterAnchoredGeometry(
        source, plate("wall", 0.5, facing(9.0))
    )
    frame = scene_graph.world_frame_id()
    X_WS = RigidTransform()
    return builder, add_lidar(
        builder, scene_graph, frame, X_WS, preset, **options
    )


def test_calibrated_returns_of_a_preset():
    unit = CalibratedReturns.of_preset("vlp-16", seed=1)
    measured = []
    for options in (
        {"returns": "calibrated", "seed": 1},
        {"returns": unit},
        {"returns": unit, "name": "other"},
        {"returns": "calibrated", "seed": 2},
    ):
        builder, lidar = facing_wall("vlp-16", **options)
        context = builder.Build().CreateDefaultContext()
        port = lidar.GetOutputPort("scan")
        scan = port.Eval(lidar.GetMyContextFromRoot(context))
        measured.append(np.column_stack([scan["x"], scan["intensity"]]))
    medians = [np.median(one[:, 1]) for one in measured]
    assert medians[0] == medians[3] > 1.0
    same = [np.array_equal(measured[0], one) for one in measured]
    assert same == [True, True, False, False]
