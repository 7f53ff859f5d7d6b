"""Traffic in a diagram: poses, labels, and points on the bodies."""

from helpers.traffic_diagrams import TrafficDiagram
import numpy as np
from pydrake.geometry import Role, SceneGraph
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.systems.framework import DiagramBuilder
import pytest
from scipy.spatial.transform import Rotation

from cns_drake.scene import read_perception_geometry
from cns_drake.sensors import Lidar, connect_lidar, make_beam_pattern
from cns_drake.traffic import (
    EgoBox,
    add_traffic,
    connect_traffic,
    play_trace,
    read_fcd,
    traffic_structures,
)

T = 2.0
# Time between two steps of a trace [s].
DT = 0.1
# Length of a bus [m].
BUS = 11.26
# A pedestrian's box: length, width, height [m].
WALKER_SIZE = (0.84, 0.6, 1.8)


def play(path, steps, zs):
    """Plays a trace without an ego car near.

    Args:
        path: the trace to write.
        steps: the rows of each step: tag, id, type, x, y, yaw, slope [deg].
        zs: height of roads, and of other ground [m].
    """
    rows = []
    for k, step in enumerate(steps):
        rows.append(f'<timestep time="{k * DT:.1f}">')
        rows += [
            f'<{tag} id="{name}" type="{kind}" x="{x:.9f}" y="{y:.9f}"'
            f' angle="{90 - np.degrees(yaw):.9f}" slope="{slope}"/>'
            for tag, name, kind, x, y, yaw, slope in step
        ]
        rows.append("</timestep>")
    path.write_text(f"<fcd-export>{''.join(rows)}</fcd-export>")

    def levels(xy, of_road):
        return np.arange(len(xy)), np.full(len(xy), zs[not of_road])

    return play_trace(
        read_fcd(path, None), path, levels, seed=1, duration=5.0, end=5.0,
        ego=lambda t: (np.full((len(t), 2), 900.0), np.zeros(len(t))),
        ego_box=EgoBox(-1.0, 3.0, 1.0),
    )  # fmt: skip


def make_plan(folder, suv_from_to=(0.0, 9.0)):
    """A bus that turns, a bicycle, a slow car, a walker and one who stands.

    The car exists for some time only.
    """
    steps = []
    for k in range(60):
        t = DT * k
        yaw = 0.3 * t
        ahead = np.array([np.cos(yaw), np.sin(yaw)])
        bus = np.array([20 * np.sin(yaw), 30 - 20 * np.cos(yaw)])
        bus += BUS / 2 * ahead
        step = [
            ("vehicle", "a", "bus", *bus, yaw, 0.0),
            ("vehicle", "b", "bicycle", -9, 4 * t - 3, np.pi / 2, 0.0),
            ("vehicle", "c", "suv", 14.3 + 0.45 * t, -8.0, 0.0, 3.0),
            ("person", "p", "", 5 - 1.3 * t, 4.0, np.pi, 0.0),
            ("person", "q", "", 3.0, -3.0, 1.0, 0.0),
        ]
        if not suv_from_to[0] <= t <= suv_from_to[1]:
            del step[2]
        steps.append(step)
    return play(folder / "trace.xml", steps, (0.2, 0.1))


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    return make_plan(tmp_path_factory.mktemp("trace"))


def test_limbs_swing_about_their_joints(tmp_path):
    """By the part of 1.2 m/s at which they walk, and all faster ones alike."""
    speeds = (0.6, 0.3, 1.5, 0.0)
    steps = [
        [
            ("person", name, "", speed * DT * k, 0.6 * DT * k * (not speed),
             0.5, 0.0)
            for name, speed in zip("pqrs", speeds, strict=True)
        ]
        for k in range(60)
    ]  # fmt: skip
    plan = play(tmp_path / "walkers.xml", steps, (0.0, 0.3))
    diagram = TrafficDiagram(plan)
    joints = {}
    for t in (0.0, 0.2, 2.9):
        values, _ = plan.walkers.at(t)
        X_WLs = diagram.limb_poses(t)
        for row, body, share in zip(
            values, diagram.traffic.bodies, (0.5, 0.25, 1, 0.5), strict=True
        ):
            X_WB = RigidTransform(RollPitchYaw(0, 0, 0.5), row[:3])
            for frame, side in zip(body.frames, (0, 1, -1, -1, 1), strict=True):
                X_BL = X_WB.inverse() @ X_WLs[frame]
                # A swing forwards is a rotation about -y.
                expected = RotationMatrix.MakeYRotation(
                    -0.36 * side * share * np.sin(row[4])
                )
                np.testing.assert_allclose(
                    X_BL.rotation().matrix(), expected.matrix(), atol=1e-9
                )
                joint = joints.setdefault(frame, X_BL.translation())
                np.testing.assert_allclose(X_BL.translation(), joint, atol=1e-9)


def test_vehicles_stand_on_slopes_and_are_away_before_they_come(tmp_path):
    """What is not there lies deep under the ground."""
    plan = make_plan(tmp_path, (2.0, 4.0))
    diagram = TrafficDiagram(plan)
    (suv,) = diagram.traffic.bodies[2].frames
    middle = 14.3 + 0.45 * 3.05 - plan.kinds[2].size[0] / 2
    X_WB = RigidTransform(
        RollPitchYaw(0.0, -np.radians(3.0), 0.0), (middle, -8.0, 0.2)
    )
    assert X_WB.IsNearlyEqualTo(diagram.limb_poses(3.05)[suv], 1e-6)
    for t in (1.5, 4.5):
        assert diagram.limb_poses(t)[suv].translation()[2] < -1_000.0


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
def scanned(request, plan):
    return (*make_diagram(plan, request.param), request.param)


def test_labels_and_instances(scanned):
    """Only objects faster than the threshold have a moving class."""
    scan = scanned[0]
    expected = {101: 257, 102: 253, 103: 10, 104: 254, 105: 30}
    found = {
        int(i): set(scan["label"][scan["instance"] == i].tolist())
        for i in np.unique(scan["instance"])
    }
    assert found == {i: {label} for i, label in expected.items()}


def test_points_lie_on_the_bodies_at_their_own_time(plan, scanned):
    """In the frame of its limb, each point is on a surface of the limb."""
    scan, traffic, scene_graph, X_WS, _, _, goes_on = scanned
    inspector = scene_graph.model_inspector()
    by_frame = {}
    for geometry in read_perception_geometry(inspector):
        by_frame.setdefault(geometry.frame_id, []).append(geometry)
    p_SR = np.stack([scan[c] for c in "xyz"], axis=1).astype(float)
    p_WR = X_WS.multiply(p_SR.T).T
    limbs = list(traffic.moving_frames)
    diagram = TrafficDiagram(plan, seed=4)
    # The same limbs in the other diagram.
    others = dict(zip(limbs, diagram.traffic.moving_frames, strict=True))
    owner = np.repeat(
        np.arange(101, 106), [1, 1, 1, *([len(limbs[3:]) // 2] * 2)]
    )
    worst = {}
    for row in np.random.default_rng(1).choice(len(scan), 300, replace=False):
        t = T + (scan["t"][row] * 1e-9 if goes_on else 0.0)
        X_WLs = diagram.limb_poses(t)
        distances = [
            _distance(geometry, X_WLs[others[frame]].inverse() @ p_WR[row])
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
    assert moving == [101, 102, 104]
    np.testing.assert_allclose(np.linalg.norm(objects.v_WO[0]), 6.0, rtol=2e-4)
    assert objects.yaw_rate[0] == pytest.approx(0.3, rel=1e-6)


def test_objects_come_and_go(tmp_path):
    """The car is there from 0.8 to 3.0 s alone."""
    plan = make_plan(tmp_path, (0.75, 3.05))
    diagram = TrafficDiagram(plan)
    ids = {}
    for time in (0.5, 1.0, 2.9, 3.2, 2.0):
        objects = diagram.output("objects", time)
        ids[time] = objects.instance.tolist()
        assert len(objects.names) == len(objects.semantic_classes)
        sizes = [plan.kinds[k].size if k < 3 else WALKER_SIZE for k in range(5)]
        assert objects.sizes.tolist() == [[*sizes[k - 1]] for k in ids[time]]
        assert objects.p_WO.shape == (len(ids[time]), 3)
        # The walker keeps his line, whichever row he has.
        assert objects.p_WO[ids[time].index(4), 1] == pytest.approx(4)
    assert ids == {
        0.5: [1, 2, 4, 5],
        1.0: [1, 2, 3, 4, 5],
        2.9: [1, 2, 3, 4, 5],
        3.2: [1, 2, 4, 5],
        2.0: [1, 2, 3, 4, 5],
    }


def test_poses_as_one_array_are_those_of_the_scene_graph(plan, scanned):
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
    other, *_ = make_diagram(plan, goes_on, is_posed=False)
    np.testing.assert_array_equal(other["instance"], scan["instance"])
    for axis in "xyz":
        np.testing.assert_allclose(other[axis], scan[axis], atol=2e-3)


def test_limbs_stay_in_the_walkers_box(plan):
    diagram = TrafficDiagram(plan, seed=9)
    inspector = diagram.inspector
    half = np.array(WALKER_SIZE) / 2
    for t in np.linspace(1, 2, 21):
        X_WLs = diagram.limb_poses(t)
        walkers, _ = plan.walkers.at(t)
        for row, body in zip(walkers, diagram.traffic.bodies[3:], strict=True):
            X_BW = RigidTransform(RollPitchYaw(0, 0, row[3]), row[:3]).inverse()
            for frame in body.frames:
                for g in inspector.GetGeometries(frame, Role.kPerception):
                    shape = inspector.GetShape(g)
                    X_BG = X_BW @ X_WLs[frame] @ inspector.GetPoseInFrame(g)
                    for end in (-1, 1):
                        p_B = X_BG @ (0.0, 0.0, end * shape.length() / 2)
                        p_B -= (0, 0, half[2])
                        assert (
                            np.abs(p_B) + shape.radius() <= half + 1e-9
                        ).all()
