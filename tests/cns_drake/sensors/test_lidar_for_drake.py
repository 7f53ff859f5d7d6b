"""What a user of Drake asks of a LiDAR: ids, rays, feedback, far places.

Oracle: closed forms.
"""

import gc

from helpers.closed_forms import box, ellipsoid
import numpy as np
from pydrake.geometry import (
    Box,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    MeshcatCone,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, SpatialInertia
from pydrake.systems.framework import DiagramBuilder
import pytest
from scipy.spatial.transform import Rotation

from cns_drake.sensors import DirectionPattern, add_lidar, make_beam_pattern

INERTIA = SpatialInertia.SolidBoxWithMass(1.0, 1.0, 1.0, 1.0)
GREY = np.full(4, 0.5)
X_PS = RigidTransform(RollPitchYaw(0.1, -0.2, 0.4), [0.3, 0.1, 0.2])


def positions(scan):
    return np.stack([scan["x"], scan["y"], scan["z"]], axis=1).astype(float)


class Field:
    """A plant with a car that carries a LiDAR."""

    def __init__(self):
        self.builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(
            self.builder, 0.0
        )
        self.car = self.add("car")

    def add(self, name, *shapes, model=None):
        options = [] if model is None else [self.plant.AddModelInstance(model)]
        body = self.plant.AddRigidBody(name, *options, INERTIA)
        for k, shape in enumerate(shapes):
            self.show(body, shape, RigidTransform([0, 0, 3.0 * k]), f"s{k}")
        return body

    def show(self, body, shape, X_BG=None, name="shape"):
        return self.plant.RegisterVisualGeometry(
            body, X_BG or RigidTransform(), shape, name, GREY
        )

    def finish(self, pattern="vlp-16", X=X_PS, **options):
        self.plant.Finalize()
        self.lidar = add_lidar(
            self.builder, self.scene_graph, self.car, X, pattern, **options
        )
        self.diagram = self.builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        self.own = self.lidar.GetMyContextFromRoot(self.context)
        return self

    def move(self, body, X_WB, w=(0, 0, 0), v=(0, 0, 0)):
        context = self.plant.GetMyMutableContextFromRoot(self.context)
        self.plant.SetFreeBodyPose(context, body, X_WB)
        self.plant.SetFreeBodySpatialVelocity(
            context=context, body=body, V_JpJc=SpatialVelocity(w, v)
        )

    def eval(self, port="scan"):
        return self.lidar.GetOutputPort(port).Eval(self.own)


def test_each_point_has_its_geometry_body_and_model():
    field = Field()
    bodies = [
        field.add("ball", Sphere(1.0), Box(1, 1, 1), model=f"robot_{k}")
        for k in range(3)
    ]
    field.finish()
    places = {}
    for k, body in enumerate(bodies):
        places[body.index()] = p = np.array([4 * np.cos(2 * k), 4 * k - 4, 0.2])
        field.move(body, RigidTransform(p))
    scan, ids = field.eval(), field.lidar.EvalGeometryIds(field.own)
    with pytest.raises(ValueError, match="read-only"):
        scan["x"][:] = 3.0
    inspector = field.scene_graph.model_inspector()
    assert len(ids) == len(scan) > 50
    p_W = field.eval("point_cloud_W").xyzs().T
    found = set()
    for geometry_id, p, instance in zip(
        ids, p_W, scan["instance"].tolist(), strict=True
    ):
        frame = inspector.GetFrameId(geometry_id)
        body = field.plant.GetBodyFromFrameId(frame)
        away = p - places[body.index()]
        if inspector.GetName(geometry_id).endswith("s0"):
            assert np.linalg.norm(away) == pytest.approx(1.0, abs=1e-4)
        else:
            far = np.abs(away - [0.0, 0.0, 3.0]).max()
            assert far == pytest.approx(0.5, abs=1e-4)
        model = field.plant.GetModelInstanceName(body.model_instance())
        found.add((instance, model))
    assert found == {(k + 1, f"robot_{k}") for k in range(3)}
    instances = field.lidar.EvalInstances(field.own)
    assert sorted(instances) == [1, 2, 3]
    for instance, of_instance in instances.items():
        frames = {inspector.GetFrameId(one) for one in of_instance}
        bodies_of = {field.plant.GetBodyFromFrameId(f).index() for f in frames}
        assert bodies_of == {bodies[instance - 1].index()}
        assert len(of_instance) == 2
    assert set(ids) <= {one for some in instances.values() for one in some}


def test_ports_have_methods_as_those_of_drakes_cameras():
    field = Field()
    field.add("ball", Sphere(1.0))
    lidar = field.finish().lidar
    names = set()
    for k in range(lidar.num_output_ports()):
        port = lidar.get_output_port(k)
        names.add(port.get_name())
        assert getattr(lidar, f"{port.get_name()}_output_port")() is port
    assert {"scan", "point_cloud_S", "point_cloud_W", "X_WS"} < names
    query = lidar.query_object_input_port()
    assert query.get_name() == "geometry_query"


def test_namesakes_in_other_scopes_are_models_of_their_own():
    field = Field()
    for scope, x in (("left", 5.0), ("right", -5.0)):
        model = f"{scope}::gripper"
        body = field.add("hand", Box(1, 1, 1), Box(1, 1, 1), model=model)
        X_WB = RigidTransform([x, 0.0, 0.0])
        field.plant.SetDefaultFloatingBaseBodyPose(body, X_WB)
    both = DirectionPattern(
        [[1, 0, 0], [-1, 0, 0]], min_range=0.1, max_range=50.0, period=0.1
    )
    scan = field.finish(both, RigidTransform()).eval()
    assert scan["x"] == pytest.approx([4.5, -4.5])
    assert scan["instance"].tolist() == [1, 2]


def test_rays_of_ones_own():
    """Rays from anywhere; neither pattern nor unit limits them."""
    rng = np.random.default_rng(3)
    field = Field()
    ball = field.add("ball", Ellipsoid(1.0, 2.0, 1.5))
    field.show(field.plant.world_body(), HalfSpace(), name="floor")
    field.finish()
    X_WB = RigidTransform(RollPitchYaw(0.3, 0.2, 1.0), [30.0, 5.0, 2.5])
    field.move(ball, X_WB)
    n = 4000
    p_WR = rng.uniform([20, -5, 0.5], [40, 15, 9], (n, 3))
    d_W = X_WB.translation() + rng.normal(size=(n, 3)) - p_WR
    d_W[: n // 4] = rng.normal(size=(n // 4, 3))
    d_W /= np.linalg.norm(d_W, axis=1, keepdims=True)
    X_BW = X_WB.inverse()
    p_B = (X_BW @ p_WR.T).T
    d_B = (X_BW.rotation() @ d_W.T).T
    on_ball = ellipsoid(p_B, d_B, (1.0, 2.0, 1.5))
    with np.errstate(divide="ignore"):
        on_floor = -p_WR[:, 2] / d_W[:, 2]
    on_floor[on_floor <= 0.0] = np.inf
    expected = np.minimum(on_ball, on_floor)
    hits = field.lidar.CastRays(field.own, p_WR, d_W)
    met = np.isfinite(expected)
    assert met.sum() > 2000
    np.testing.assert_array_equal(np.isfinite(hits.ranges), met)
    np.testing.assert_allclose(
        hits.ranges[met], expected[met], rtol=1e-5, atol=1e-5
    )
    inspector = field.scene_graph.model_inspector()
    for k, geometry_id in enumerate(hits.geometry_ids):
        assert (geometry_id is None) == (not met[k])
        if geometry_id is not None:
            is_floor = inspector.GetName(geometry_id).endswith("floor")
            assert is_floor == (on_floor[k] < on_ball[k])
    up = hits.normals_W[met & (on_floor < on_ball)]
    np.testing.assert_allclose(up, np.tile([0, 0, 1.0], (len(up), 1)))
    # One origin, limits of one's own.
    hits = field.lidar.CastRays(
        field.own, [0, 0, 5.0], [[0, 0, -1.0]] * 2, [4.999, 5.001]
    )
    assert hits.ranges.tolist() == [np.inf, 5.0]
    assert hits.geometry_ids[0] is None
    none = field.lidar.CastRays(field.own, np.zeros((0, 3)), np.zeros((0, 3)))
    assert none.geometry_ids == []


@pytest.mark.parametrize(
    ("p_WR", "d_W", "max_range", "fault"),
    [
        ([0, 0, 0], [1, 0, 0], 9.0, r"d_W \(3,\)"),
        ([[0, 0, 0]] * 2, [[1, 0, 0]] * 3, 9.0, r"p_WR \(2, 3\)"),
        ([0, 0, 0], [[1, 0, 0]], [9.0, 9.0], r"max_range \(2,\)"),
        ([0, 0, 0], [[1.00001, 0, 0]], 9.0, "length 1"),
        ([0, 0, 0], [[np.nan, 0, 0]], 9.0, "length 1"),
        ([0, np.inf, 0], [[1, 0, 0]], 9.0, "not finite"),
        ([0, 0, 0], [[1, 0, 0]], np.nan, "not finite"),
        ([0, 0, 0], [[1, 0, 0]], -1.0, "negative"),
    ],
)
def test_rays_that_are_none(p_WR, d_W, max_range, fault):
    field = Field()
    field.add("ball", Sphere(1.0))
    field.finish()
    with pytest.raises(ValueError, match=fault):
        field.lidar.CastRays(field.own, p_WR, d_W, max_range)


def in_the_turn(field, body, closed_form, pattern, motion, causal):
    """Compares a scan with the closed form, beam by beam."""
    (X_WP, w, v), (X_WB, w_B, v_B) = motion
    beams = pattern.beams(0)
    t = beams.t_ns * 1e-9 - (pattern.period if causal else 0.0)

    def poses(X, w, v):
        R = Rotation.from_rotvec(t[:, None] * np.array(w, float)).as_matrix()
        return R @ X.rotation().matrix(), X.translation() + t[:, None] * v

    R_WP, p_WP = poses(X_WP, w, np.array(v, float))
    R_WS = R_WP @ X_PS.rotation().matrix()
    p_WS = p_WP + R_WP @ X_PS.translation()
    R_WB, p_WB = poses(X_WB, w_B, np.array(v_B, float))
    d_W = np.einsum("nij,nj->ni", R_WS, beams.d_Sset)
    p_B = np.einsum("nji,nj->ni", R_WB, p_WS - p_WB)
    expected = closed_form(p_B, np.einsum("nji,nj->ni", R_WB, d_W))
    scan = field.eval()
    keys = list(zip(beams.ring.tolist(), beams.t_ns.tolist(), strict=True))
    measured = dict.fromkeys(keys, np.inf)
    for one, distance in zip(
        scan, np.linalg.norm(positions(scan), axis=1), strict=True
    ):
        measured[int(one["ring"]), int(one["t"])] = distance
    measured = np.array([measured[key] for key in keys])
    expected[expected > pattern.max_range] = np.inf
    both = np.isfinite(expected) & np.isfinite(measured)
    assert both.sum() > 100
    assert (np.isfinite(expected) != np.isfinite(measured)).sum() <= 3
    error = np.abs(expected[both] - measured[both])
    assert np.median(error) < 1e-5
    assert (error > 1e-3).mean() < 0.02
    # Points lie on the body where it was then.
    p_W = field.eval("point_cloud_W").xyzs().T
    order = {key: k for k, key in enumerate(keys)}
    rows = [order[int(one["ring"]), int(one["t"])] for one in scan]
    expected_W = p_WS[rows] + np.einsum(
        "nij,nj->ni", R_WS[rows], positions(scan)
    )
    np.testing.assert_allclose(p_W, expected_W, atol=1e-5)


@pytest.mark.parametrize("causal", [False, True])
@pytest.mark.parametrize("first", [0.0, 0.03])
def test_a_turn_before_or_after_its_time(causal, first):
    """Beams are cast where sensor and bodies were, or will be, then.

    X_WS is the pose at the time of the output, whenever the first beam fires.
    """
    rng = np.random.default_rng(5)
    n = 3000
    d = np.column_stack([np.ones(n), *rng.uniform(-0.6, 0.6, (2, n))])
    pattern = DirectionPattern(
        d,
        min_range=0.0,
        max_range=60.0,
        period=0.1,
        times=np.linspace(first, 0.0999, n),
        rings=np.arange(n),
    )
    field = Field()
    body = field.add("other", Box(2.0, 3.0, 1.5))
    field.finish(pattern, motion_distortion=True, causal=causal)
    motion = (
        (
            RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [1, 2, 0.5]),
            [0.3, -0.2, 1.5],
            [12.0, 3.0, -1.0],
        ),
        (
            RigidTransform(RollPitchYaw(0.4, -0.1, 1.0), [8.0, 6.0, -1.0]),
            [1.0, 2.0, -3.0],
            [-9.0, 4.0, 2.0],
        ),
    )
    for one, moved in zip((field.car, body), motion, strict=True):
        field.move(one, *moved)
    X_WS = motion[0][0] @ X_PS
    assert field.eval("X_WS").IsNearlyEqualTo(X_WS, 1e-12)
    in_the_turn(
        field,
        body,
        lambda p, d: box(p, d, (2.0, 3.0, 1.5)),
        pattern,
        motion,
        causal,
    )
    # Rays are cast at the time of the Context, in both modes.
    X_WB = motion[1][0]
    p_WR = X_WB @ [0.0, 0.0, 5.0]
    down = X_WB.rotation() @ [0.0, 0.0, -1.0]
    hits = field.lidar.CastRays(field.own, p_WR, [down])
    assert hits.ranges[0] == pytest.approx(4.25, abs=1e-5)


def test_a_causal_turn_has_the_beams_and_the_noise_of_its_number():
    scans = {}
    for causal in (False, True):
        field = Field()
        field.show(field.plant.world_body(), HalfSpace(), RigidTransform())
        field.finish(
            make_beam_pattern("mid-360"),
            RigidTransform([0, 0, 1.0]),
            causal=causal,
            range_noise=0.01,
            seed=4,
        )
        for turn in (2, 3):
            field.context.SetTime(0.1 * turn)
            scans[causal, turn] = field.eval().copy()
    np.testing.assert_array_equal(scans[False, 2], scans[True, 3])
    assert len(scans[False, 2]) != len(scans[True, 2]) or not np.array_equal(
        scans[False, 2], scans[True, 2]
    )


@pytest.mark.parametrize("anchored", [False, True])
@pytest.mark.parametrize("offset", [1e3, 2.5e4, 5e5, 4e6])
def test_places_far_from_the_origin(offset, anchored):
    """Coordinates of national surveys, with and without anchored geometry."""
    rng = np.random.default_rng(8)
    far = np.array([offset, -offset / 3.0, 30.0])
    directions = rng.normal(size=(300, 3)) * [1.0, 0.3, 0.3] + [3.0, 0, 0]
    pattern = DirectionPattern(
        directions, min_range=0.1, max_range=90.0, period=0.1
    )
    d = pattern.beams(0).d_Sset
    field = Field()
    balls = [field.add(f"ball_{k}", Sphere(1.0 + k)) for k in range(2)]
    field.show(field.plant.world_body(), HalfSpace(), name="ground")
    if anchored:
        X_WG = RigidTransform([offset, 0, -5])
        field.show(field.plant.world_body(), Box(1, 1, 1), X_WG, "box")
    field.finish(pattern, RigidTransform())
    for step in (0.0, 0.377, 700.0):
        p_WC = far + np.array([step, 0.123, 0.0])
        field.move(field.car, RigidTransform(p_WC))
        expected = np.full(len(d), np.inf)
        for k, ball in enumerate(balls):
            p_CB = np.array([10.0 + 5 * k, 2.0 * k - 1.0, 0.5])
            field.move(ball, RigidTransform(p_WC + p_CB))
            expected = np.minimum(expected, ellipsoid(-p_CB, d, (1.0 + k,) * 3))
        with np.errstate(divide="ignore"):
            ground = -30.0 / d[:, 2]
        ground[(ground < 0.0) | (ground > 90.0)] = np.inf
        expected = np.minimum(expected, ground)
        scan = field.eval()
        sure = np.isfinite(expected)
        assert len(scan) == pytest.approx(sure.sum(), abs=2)
        # Where the outline is met it is steep.
        measured = np.linalg.norm(positions(scan), axis=1)
        along = positions(scan) / measured[:, None]
        nearest = (along @ d.T).argmax(axis=1)
        error = np.abs(measured - expected[nearest])
        assert np.median(error) < 5e-5
        assert (error < 2e-3).mean() > 0.97


def test_a_scan_far_out_depends_on_its_place_alone():
    """Whatever the way there: coordinates do not depend on earlier scans."""
    scans = []
    for way in ((5.1e5,), (0.0, 300.0, 1e5, 5.1e5 - 900.0, 5.1e5)):
        field = Field()
        ball = field.add("ball", Cylinder(1.0, 3.0))
        field.show(field.plant.world_body(), Box(9, 9, 1), name="box")
        field.finish()
        for x in way:
            field.move(field.car, RigidTransform([x, 0.0, 0.3]))
            field.move(ball, RigidTransform([x + 5.0, 0.1, 0.2]))
            scans.append(field.eval().copy())
    assert len(scans[0]) > 20
    np.testing.assert_array_equal(scans[0], scans[-1])


def test_planes_and_what_stands_before_them():
    """Two planes, one of them on a body, with a box before and behind."""
    d = [[0, 0, -1], [0.6, 0, -0.8], [1, 0, 0], [0, 0, 1], [0, 1, 0]]
    pattern = DirectionPattern(
        d, min_range=0.1, max_range=9.0, period=0.1, rings=range(5)
    )
    field = Field()
    world = field.plant.world_body()
    wall = field.add("wall", HalfSpace())
    field.show(world, HalfSpace(), name="floor")
    field.show(world, Box(1, 1, 1), RigidTransform([0, 0, 1.5]), "before")
    field.show(world, Box(9, 1, 1), RigidTransform([0, 0, -4.0]), "behind")
    field.finish(pattern, RigidTransform())
    field.move(field.car, RigidTransform([0, 0, 4.0]))
    # The wall faces the car, and is then out of reach.
    for ahead in (8.999, 9.001):
        seen = {0: 2.0, 1: 5.0} | ({2: ahead} if ahead < 9.0 else {})
        X_WB = RigidTransform(RollPitchYaw(0, -np.pi / 2, 0), [ahead, 0, 0])
        field.move(wall, X_WB)
        scan = field.eval()
        measured = np.linalg.norm(positions(scan), axis=1)
        found = dict(zip(scan["ring"].tolist(), measured, strict=True))
        assert found == pytest.approx(seen, abs=1e-5)


def test_a_cone_is_true():
    rng = np.random.default_rng(2)
    n = 2000
    height = 4.0
    a = 10.0
    b = 6.0
    field = Field()
    cone = field.add("cone", MeshcatCone(height, a, b))
    d = rng.normal(size=(n, 3)) * [1.0, 1.0, 0.2]
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    pattern = DirectionPattern(d, min_range=0.0, max_range=40.0, period=0.1)
    field.finish(pattern, RigidTransform())
    # The sensor is inside, below the base, and meets the mantle.
    p = np.array([0.5, -0.4, 2.0])
    field.move(field.car, RigidTransform(p))
    scale = np.array([1 / a, 1 / b, 1 / height])
    P = p * scale
    D = d * scale
    sign = np.array([1.0, 1.0, -1.0])
    A, B = (D * D * sign).sum(axis=1), (P * D * sign).sum(axis=1)
    root = np.sqrt(B * B - A * (P * P * sign).sum())
    roots = np.stack([(-B - root) / A, (-B + root) / A])
    z = P[2] + roots * D[:, 2]
    roots[(roots <= 0.0) | (z < 0.0) | (z > 1.0)] = np.inf
    expected = roots.min(axis=0)
    scan = field.eval()
    measured = np.linalg.norm(positions(scan), axis=1)
    nearest = (positions(scan) / measured[:, None] @ d.T).argmax(axis=1)
    mantle = np.isfinite(expected[nearest])
    assert mantle.sum() > 1000
    error = np.abs(measured - expected[nearest])[mantle]
    assert error.max() < 5e-4
    assert field.plant.GetBodyByName("cone").index() == cone.index()


def test_a_frame_that_a_context_moves_stays_for_the_lidar():
    """As for Drake's cameras, the model says where it is."""
    field = Field()
    ball = field.add("ball", Sphere(1.0))
    frame = field.plant.AddFrame(
        FixedOffsetFrame("mast", field.car, RigidTransform([1.0, 0, 0]))
    )
    field.plant.Finalize()
    lidar = add_lidar(
        field.builder, field.scene_graph, frame, RigidTransform(), "vlp-16"
    )
    field.context = field.builder.Build().CreateDefaultContext()
    field.move(ball, RigidTransform([9.0, 0, 0]))
    field.move(field.car, RigidTransform())
    frame.SetPoseInParentFrame(
        field.plant.GetMyMutableContextFromRoot(field.context),
        RigidTransform([5.0, 0, 0]),
    )
    X_WS = lidar.GetOutputPort("X_WS").Eval(
        lidar.GetMyContextFromRoot(field.context)
    )
    assert X_WS.translation().tolist() == [1.0, 0.0, 0.0]


def test_an_error_leaves_no_pose_behind():
    """The pose of one body changes in the turn in which another is too fast."""
    field = Field()
    wheel = field.add("wheel", Box(1, 1, 1))
    crate = field.add("crate", Box(1, 1, 1))
    beam = DirectionPattern(
        [[1, 0, 0]], min_range=0.1, max_range=50.0, period=0.1
    )
    field.finish(beam, RigidTransform(), motion_distortion=True)
    field.move(field.car, RigidTransform())
    for x, w in ((8.0, 0.0), (4.0, 1e5), (4.0, 0.0)):
        field.move(wheel, RigidTransform([0.0, 0.0, 9.0]), w=(0, 0, w))
        field.move(crate, RigidTransform([x, 0.0, 0.0]))
        if w:
            with pytest.raises(ValueError, match="a body turns by 10000 rad"):
                field.eval()
        else:
            assert field.eval()["x"] == pytest.approx([x - 0.5])


def test_lidars_of_many_diagrams_share_their_beams():
    """A dropped Diagram may stay in memory: little of it may be large."""
    revolutions = set()
    for _ in range(3):
        for preset in ("os1-128", "mid-360"):
            field = Field()
            field.add("ball", Sphere(1.0))
            field.finish(preset)
            field.eval()
            scanner = field.lidar._scanner
            revolutions.add(id(scanner._first))
            own = sum(
                value.nbytes
                for part in (field.lidar, scanner)
                for value in vars(part).values()
                if isinstance(value, np.ndarray)
            )
            assert own < 200_000
    gc.collect()
    assert len(revolutions) == 2


def ahead_at(time=0.0):
    """One beam along x that is fired at a time of the turn."""
    return DirectionPattern(
        [[1, 0, 0]], times=[time], min_range=0.1, max_range=99, period=0.1
    )


def test_a_frame_id_stands_for_its_own_geometry_only():
    """As carrier and in `unseen`; a body stands for what is welded to it."""
    for carrier, unseen, expected in (
        ("body", None, 7.5),
        ("frame", None, 3.5),
        ("body", "frame", 3.5),
        ("body", "body", 3.5),
        ("body", "all", 7.5),
    ):
        field = Field()
        field.show(field.car, Sphere(0.5), RigidTransform([2.0, 0.0, 0.0]))
        mast = field.add("mast")
        field.show(mast, Sphere(0.5), RigidTransform([4.0, 0.0, 0.0]))
        field.plant.WeldFrames(field.car.body_frame(), mast.body_frame())
        wall = RigidTransform([8.0, 0.0, 0.0])
        field.show(field.plant.world_body(), Box(1, 9, 9), wall)
        ids = [
            field.plant.GetBodyFrameIdOrThrow(body.index())
            for body in (field.car, mast)
        ]
        options = {
            None: {},
            "frame": {"unseen": ids[:1]},
            "body": {"unseen": [field.car]},
            "all": {"unseen": [ids[0], mast]},
        }[unseen]
        if carrier == "frame":
            field.car = ids[0]
        field.finish(ahead_at(), RigidTransform(), **options)
        assert field.eval()["x"] == pytest.approx([expected], abs=1e-5)


def test_bodies_of_another_plant_stay_during_a_turn():
    """Those of the LiDAR's own plant move."""
    for is_own, expected in ((True, 8.5), (False, 9.0)):
        field = Field()
        other = field.plant
        if not is_own:
            other = field.builder.AddSystem(MultibodyPlant(0.0))
            other.RegisterAsSourceForSceneGraph(field.scene_graph)
            field.builder.Connect(
                other.get_geometry_pose_output_port(),
                field.scene_graph.get_source_pose_port(other.get_source_id()),
            )
        body = other.AddRigidBody("other", INERTIA)
        X_BG = RigidTransform([10.0, 0.0, 0.0])
        other.RegisterVisualGeometry(body, X_BG, Box(2, 2, 2), "box", GREY)
        if not is_own:
            other.Finalize()
        field.finish(ahead_at(0.05), RigidTransform(), motion_distortion=True)
        other.SetFreeBodySpatialVelocity(
            context=other.GetMyMutableContextFromRoot(field.context),
            body=body,
            V_JpJc=SpatialVelocity([0, 0, 0], [-10.0, 0.0, 0.0]),
        )
        assert field.eval()["x"] == pytest.approx([expected], abs=1e-5)
