"""Traffic in a diagram: poses, labels, and points on the bodies."""

from dataclasses import replace

import numpy as np
from pydrake.geometry import Role, SceneGraph
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.systems.framework import DiagramBuilder
import pytest
from scipy.spatial.transform import Rotation

from cns_drake.scene import read_perception_geometry
from cns_drake.sensors import Lidar, connect_lidar, make_beam_pattern
from cns_drake.traffic import (
    TrafficPlan,
    add_traffic,
    connect_traffic,
    traffic_structures,
)
from cns_drake.traffic.body_shapes import Limb
from cns_drake.traffic.tracks import Tracks
from cns_drake.traffic.traffic_motion import (
    MOVING_SPEED,
    BodyStates,
    LimbTable,
    bodies_at,
    make_traffic,
)
from cns_drake.traffic.traffic_plan import WALKER_SIZE
from cns_drake.traffic.vehicle_kinds import KINDS

T = 2.0


def test_limbs_swing_about_their_joints():
    joints = np.array([(0.3, -0.2, 1.1), (-0.4, 0.5, 0.8), (0.1, 0.2, 0.9)])
    swings = 0.6, -0.35, 0.2
    one, two, gone = (
        Limb(f"limb_{k}", tuple(joint), swing, ())
        for k, (joint, swing) in enumerate(zip(joints, swings, strict=True))
    )
    p_WBs = np.array([(4.0, -7.0, 0.2), (1.0, 2.0, 3.0)])
    states = BodyStates(
        p_WBs,
        np.zeros((2, 3)),
        yaw=np.array([0.9, -2.0]),
        pitch=np.array([-0.15, 0.1]),
        yaw_rate=np.zeros(2),
        present=np.array([True, False]),
        swing=np.array([0.7, -1.0]),
    )
    table = LimbTable([(one, two), (gone,)])
    assert table.body.tolist() == [0, 0, 1]
    X_WLs = table.poses(states)
    X_WB = RigidTransform(RollPitchYaw(0.0, -0.15, 0.9), p_WBs[0])
    for X_WL, joint, swing in zip(X_WLs, joints, swings[:2], strict=False):
        X_BL = RigidTransform(RollPitchYaw(0.0, -0.7 * swing, 0.0), joint)
        np.testing.assert_allclose(
            X_WL, (X_WB @ X_BL).GetAsMatrix4(), atol=1e-12
        )
    # A body that is not there lies deep under the ground.
    assert X_WLs[2, 2, 3] < -1_000.0


def make_plan():
    """A bus that turns, a slow car, a bicycle, a walker and one who stands."""
    t = 0.1 * np.arange(60)
    zero = np.zeros_like(t)
    kinds = [
        next(k for k in KINDS if k.name == n) for n in ("bus", "suv", "bicycle")
    ]
    angle = 0.3 * t
    bus = [20 * np.sin(angle), 30 - 20 * np.cos(angle), zero, angle, zero]
    car = [12 + 0.9 * MOVING_SPEED * t, zero - 8, zero, zero, zero - 0.05]
    bicycle = [zero - 9, 4 * t - 4, zero + 0.2, zero + np.pi / 2, zero]
    walker = [5 - 1.3 * t, zero + 4, zero, zero + np.pi, 6 * t]
    stands = [zero + 3, zero - 3, zero, zero + 1, zero + 1.5]
    return TrafficPlan(
        tuple(kinds),
        Tracks(0.1, np.array([bus, car, bicycle]).transpose(2, 0, 1)),
        Tracks(0.1, np.array([walker, stands]).transpose(2, 0, 1)),
    )


def test_slow_walkers_swing_their_limbs_less():
    """By the part of 1.2 m/s at which they walk, and all faster ones alike."""
    t = 0.1 * np.arange(30)
    zero = np.zeros(30)
    rows = [[speed * t, zero, zero, zero, 5.0 * t] for speed in (0.6, 0.3, 1.5)]
    rows.append([zero, 0.6 * t, zero, zero, 5.0 * t])
    none = Tracks(0.1, np.zeros((30, 0, 5)))
    plan = TrafficPlan((), none, Tracks(0.1, np.transpose(rows, (2, 0, 1))))
    for time in (0.0, 0.2, 2.9):
        expected = np.sin(5.0 * time) * np.array([0.5, 0.25, 1.0, 0.5])
        np.testing.assert_allclose(
            bodies_at(plan, time).swing, expected, atol=1e-12
        )


def make_diagram(plan, goes_on, is_posed=True):
    builder = DiagramBuilder()
    scene_graph = builder.AddSystem(SceneGraph())
    structures = traffic_structures(plan, 101)
    traffic = add_traffic(
        builder, scene_graph, plan, seed=4, structures=structures, turn=0.05
    )
    X_WS = RigidTransform(
        RotationMatrix.MakeZRotation(0.4), np.array([0.5, 0.2, 1.4])
    )
    lidar = builder.AddNamedSystem(
        "lidar",
        Lidar(
            scene_graph.world_frame_id(),
            X_WS,
            make_beam_pattern("os1-128", 0.05),
            structures=structures,
            moving_bodies=traffic.moving_frames if goes_on else None,
        ),
    )
    connect_lidar(builder, scene_graph, lidar)
    if is_posed:
        connect_traffic(builder, traffic, lidar, goes_on)
    else:
        names = ["moving_instances"]
        names += ["body_spatial_velocities"] if goes_on else []
        for name in names:
            builder.Connect(
                traffic.GetOutputPort(name), lidar.GetInputPort(name)
            )
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    context.SetTime(T)
    scan = lidar.GetOutputPort("scan").Eval(lidar.GetMyContextFromRoot(context))
    return scan, traffic, scene_graph, X_WS, diagram, context


@pytest.fixture(scope="module", params=[False, True])
def scanned(request):
    return (*make_diagram(make_plan(), request.param), request.param)


def test_labels_and_instances(scanned):
    """Only objects faster than the threshold have a moving class."""
    scan = scanned[0]
    expected = {101: 257, 102: 10, 103: 253, 104: 254, 105: 30}
    found = {
        int(i): set(scan["label"][scan["instance"] == i].tolist())
        for i in np.unique(scan["instance"])
    }
    assert found == {i: {label} for i, label in expected.items()}


def test_points_lie_on_the_bodies_at_their_own_time(scanned):
    """In the frame of its limb, each point is on a surface of the limb."""
    scan, traffic, scene_graph, X_WS, _, _, goes_on = scanned
    inspector = scene_graph.model_inspector()
    by_frame = {}
    for geometry in read_perception_geometry(inspector):
        by_frame.setdefault(geometry.frame_id, []).append(geometry)
    p_SR = np.stack([scan[c] for c in "xyz"], axis=1).astype(float)
    p_WR = X_WS.multiply(p_SR.T).T
    limbs = list(traffic.moving_frames)
    owner = np.repeat(
        np.arange(101, 106), [1, 1, 1, *([len(limbs[3:]) // 2] * 2)]
    )
    worst = {}
    for row in np.random.default_rng(1).choice(len(scan), 300, replace=False):
        t = T + (scan["t"][row] * 1e-9 if goes_on else 0.0)
        X_WLs = traffic._limbs.poses(bodies_at(make_plan(), t))
        R_WL, p_WL = X_WLs[:, :3, :3], X_WLs[:, :3, 3]
        distances = [
            _distance(geometry, R_WL[k].T @ (p_WR[row] - p_WL[k]))
            for k, frame in enumerate(limbs)
            if owner[k] == scan["instance"][row]
            for geometry in by_frame[frame]
        ]
        instance = int(scan["instance"][row])
        worst[instance] = max(worst.get(instance, 0.0), min(distances))
    # Coordinates are exact but for single precision; a limb that swings goes
    # its way from beginning to end of a turn straight.
    assert set(worst) == {101, 102, 103, 104, 105}
    for instance, distance in worst.items():
        assert distance < (4e-3 if instance == 104 and goes_on else 1e-3)


def _distance(geometry, p_F):
    """Returns the distance of a place in F from a geometry's surface."""
    p_G = geometry.X_FG.inverse() @ p_F
    surface = geometry.surface
    if hasattr(surface, "triangles"):
        return _distance_to_triangles(surface.p_GVset[surface.triangles], p_G)
    half = surface.length / 2
    off = np.hypot(p_G[0], p_G[1])
    if type(surface).__name__ == "CapsuleSurface":
        beyond = max(abs(p_G[2]) - half, 0.0)
        return abs(np.hypot(off, beyond) - surface.radius)
    side, end = abs(off - surface.radius), abs(abs(p_G[2]) - half)
    on_side = side if abs(p_G[2]) <= half + 1e-3 else np.inf
    return min(on_side, end if off <= surface.radius + 1e-3 else np.inf)


def _distance_to_triangles(corners, p):
    """Returns the distance to the nearest triangle (N, 3, 3)."""
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1)
    normal = normal / np.maximum(size, 1e-12)[:, None]
    height = np.sum((p - a) * normal, axis=1)
    foot = p - height[:, None] * normal
    inside = np.ones(len(a), bool)
    edge = np.full(len(a), np.inf)
    for u, v in ((a, b), (b, c), (c, a)):
        inside &= np.sum(np.cross(v - u, foot - u) * normal, axis=1) >= -1e-9
        along = np.sum((p - u) * (v - u), axis=1)
        along /= np.maximum(np.sum((v - u) ** 2, axis=1), 1e-12)
        near = u + np.clip(along, 0, 1)[:, None] * (v - u)
        edge = np.minimum(edge, np.linalg.norm(p - near, axis=1))
    return float(np.min(np.where(inside, np.abs(height), edge)))


def test_points_in_boxes_are_those_of_instances(scanned):
    scan, traffic, _, X_WS, _, context, goes_on = scanned
    if goes_on:
        return
    objects = traffic.GetOutputPort("objects").Eval(
        traffic.GetMyContextFromRoot(context)
    )
    assert objects.instance.tolist() == [101, 102, 103, 104, 105]
    p_WR = X_WS.multiply(np.stack([scan[c] for c in "xyz"]).astype(float))
    for k, instance in enumerate(objects.instance):
        R_WO = Rotation.from_quat(objects.quat_xyzw[k]).as_matrix()
        p_OR = R_WO.T @ (p_WR - objects.p_WO[k][:, None])
        half = objects.sizes[k][:, None] / 2
        inside = (np.abs(p_OR) <= half + 1e-3).all(axis=0)
        own = scan["instance"] == instance
        np.testing.assert_array_equal(inside, own)
    moving = objects.instance[objects.is_moving].tolist()
    assert moving == [101, 103, 104]
    np.testing.assert_allclose(np.linalg.norm(objects.v_WO[0]), 6.0, rtol=2e-4)
    assert objects.yaw_rate[0] == pytest.approx(0.3, rel=1e-6)


def test_objects_come_and_go():
    plan = make_plan()
    # The second vehicle is there from 0.8 to 3.0 s alone.
    present = np.ones((60, 3), bool)
    present[:8, 1] = present[31:, 1] = False
    vehicles = Tracks(plan.vehicles.dt, plan.vehicles.values, present)
    traffic = make_traffic(SceneGraph(), replace(plan, vehicles=vehicles))
    context = traffic.CreateDefaultContext()
    port = traffic.GetOutputPort("objects")
    ids = {}
    for time in (0.5, 1.0, 2.9, 3.2, 2.0):
        context.SetTime(time)
        objects = port.Eval(context)
        ids[time] = objects.instance.tolist()
        assert len(objects.names) == len(objects.semantic_classes)
        assert objects.sizes.tolist() == [
            [*plan.kinds[k - 1].size] if k < 4 else [*WALKER_SIZE]
            for k in ids[time]
        ]
        assert objects.p_WO.shape == (len(ids[time]), 3)
        # The bicycle keeps its line, whichever row it has.
        assert objects.p_WO[ids[time].index(3), 0] == pytest.approx(-9)
    assert ids == {
        0.5: [1, 3, 4, 5],
        1.0: [1, 2, 3, 4, 5],
        2.9: [1, 2, 3, 4, 5],
        3.2: [1, 3, 4, 5],
        2.0: [1, 2, 3, 4, 5],
    }


def test_poses_as_one_array_are_those_of_the_scene_graph(scanned):
    """A LiDAR measures the same with either of them."""
    scan, traffic, scene_graph, _, _, context, goes_on = scanned
    query_object = scene_graph.get_query_output_port().Eval(
        scene_graph.GetMyContextFromRoot(context)
    )
    known = traffic.GetOutputPort("frame_poses").Eval(
        traffic.GetMyContextFromRoot(context)
    )
    for frame, row in known.rows.items():
        np.testing.assert_allclose(
            query_object.GetPoseInWorld(frame).GetAsMatrix4(),
            known.X_WFs[row],
            atol=1e-13,
        )
    other, *_ = make_diagram(make_plan(), goes_on, is_posed=False)
    np.testing.assert_array_equal(other["instance"], scan["instance"])
    for axis in "xyz":
        np.testing.assert_allclose(other[axis], scan[axis], atol=2e-3)


def test_limbs_stay_in_the_walkers_box():
    plan = make_plan()
    scene_graph = SceneGraph()
    traffic = make_traffic(scene_graph, plan, seed=9)
    inspector = scene_graph.model_inspector()
    half = np.array(WALKER_SIZE) / 2
    for t in np.linspace(1, 2, 21):
        states = bodies_at(plan, t)
        R_WB = Rotation.from_quat(states.quat_xyzw).as_matrix()
        X_WLs = traffic._limbs.poses(states)
        R_WL, p_WL = X_WLs[:, :3, :3], X_WLs[:, :3, 3]
        for frame, k in traffic.moving_frames.items():
            body = traffic._limbs.body[k]
            if body < 3:
                continue
            for g in inspector.GetGeometries(frame, Role.kPerception):
                shape, X = inspector.GetShape(g), inspector.GetPoseInFrame(g)
                for end in (-1, 1):
                    p_L = X @ np.array([0, 0, end * shape.length() / 2])
                    p_W = p_WL[k] + R_WL[k] @ p_L - states.p_WB[body]
                    p_B = R_WB[body].T @ p_W - (0, 0, half[2])
                    assert (np.abs(p_B) + shape.radius() <= half + 1e-9).all()
