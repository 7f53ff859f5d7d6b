"""Motion during a turn: of the LiDAR, and of visible bodies.

Oracle: closed forms, ray by ray, in the frame of each body at the time of
that ray.
"""

from helpers.closed_forms import box, capsule, cylinder, ellipsoid
import numpy as np
from pydrake.geometry import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.framework import DiagramBuilder
import pytest
from scipy.spatial.transform import Rotation

from cns_drake.sensors import SpinningPattern, add_lidar, make_beam_pattern

PATTERN = SpinningPattern(
    tuple(np.linspace(0.4, -0.4, 12)), 240, 0.05, 60.0, 0.1
)
X_PS = RigidTransform(RollPitchYaw(0.1, -0.2, 0.4), [0.3, 0.1, 0.2])
# The pose of a shape on its body, so that it is swung round, too.
X_BG = RigidTransform(RollPitchYaw(0.3, 0.5, -0.2), [0.5, -0.4, 0.3])
SHAPES = {
    "box": (Box(1.0, 2.0, 1.5), lambda p, d: box(p, d, (1.0, 2.0, 1.5))),
    "sphere": (Sphere(1.2), lambda p, d: ellipsoid(p, d, (1.2,) * 3)),
    "ellipsoid": (
        Ellipsoid(0.6, 1.6, 1.0),
        lambda p, d: ellipsoid(p, d, (0.6, 1.6, 1.0)),
    ),
    "cylinder": (Cylinder(0.8, 2.5), lambda p, d: cylinder(p, d, 0.8, 2.5)),
    "capsule": (Capsule(0.7, 1.8), lambda p, d: capsule(p, d, 0.7, 1.8)),
    "half space": (HalfSpace(), lambda p, d: plane(p, d)),
}
SENSOR_V = SpatialVelocity(w=[0.4, -0.3, 2.0], v=[9.0, -4.0, 1.0])
STILL = SpatialVelocity(w=[0.0, 0.0, 0.0], v=[0.0, 0.0, 0.0])
SWUNG = SpatialVelocity(w=[1.0, 0.5, -4.0], v=[-12.0, 7.0, 2.0])
# The body turns two and a half times during one turn of the LiDAR.
WHIRLING = SpatialVelocity(w=[0.0, 157.0, 0.0], v=[3.0, 0.0, 0.0])


def plane(p, d):
    with np.errstate(divide="ignore"):
        distance = -p[:, 2] / d[:, 2]
    return np.where(distance > 0.0, distance, np.inf)


class Meeting:
    """A robot with a LiDAR and a body that carries a shape."""

    def __init__(self, shape, pattern=PATTERN, **options):
        builder = DiagramBuilder()
        self.plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        inertia = SpatialInertia.SolidBoxWithDensity(1.0, 1.0, 1.0, 1.0)
        self.robot = self.plant.AddRigidBody("robot", inertia)
        self.other = self.plant.AddRigidBody("other", inertia)
        grey = [0.5, 0.5, 0.5, 1.0]
        self.plant.RegisterVisualGeometry(
            self.other, X_BG, shape, "shape", grey
        )
        self.plant.Finalize()
        options.setdefault("motion_distortion", True)
        self.lidar = add_lidar(
            builder, scene_graph, self.robot, X_PS, pattern, **options
        )
        self.pattern = pattern
        self.context = builder.Build().CreateDefaultContext()
        self.X_WBs = [
            RigidTransform(RollPitchYaw(-0.1, 0.2, 0.9), [1.0, -2.0, 0.5]),
            RigidTransform(RollPitchYaw(0.5, -0.3, 0.2), [-2.0, -4.5, 0.4]),
        ]

    def move(self, *V_WBs):
        self.V_WBs = V_WBs
        context = self.plant.GetMyMutableContextFromRoot(self.context)
        bodies = (self.robot, self.other)
        for body, X_WB, V_WB in zip(bodies, self.X_WBs, V_WBs, strict=True):
            self.plant.SetFreeBodyPose(context, body, X_WB)
            self.plant.SetFreeBodySpatialVelocity(context, body, V_WB)

    def eval(self, port="scan"):
        context = self.lidar.GetMyContextFromRoot(self.context)
        return self.lidar.GetOutputPort(port).Eval(context)

    def poses(self, body, t):
        """Rotations and positions of a body at times."""
        X_WB, V_WB = self.X_WBs[body], self.V_WBs[body]
        turned = Rotation.from_rotvec(t[:, None] * V_WB.rotational())
        return (
            turned.as_matrix() @ X_WB.rotation().matrix(),
            X_WB.translation() + t[:, None] * V_WB.translational(),
        )

    def expected(self, closed_form, frame=0):
        """Ranges of all beams."""
        beams = self.pattern.beams(frame)
        t = beams.t_ns * 1e-9
        R_WP, p_WP = self.poses(0, t)
        R_WS = R_WP @ X_PS.rotation().matrix()
        p_WS = p_WP + R_WP @ X_PS.translation()
        R_WB, p_WB = self.poses(1, t)
        R_WG = R_WB @ X_BG.rotation().matrix()
        p_WG = p_WB + R_WB @ X_BG.translation()
        d_W = np.einsum("nij,nj->ni", R_WS, beams.d_Sset)
        p_G = np.einsum("nji,nj->ni", R_WG, p_WS - p_WG)
        return closed_form(p_G, np.einsum("nji,nj->ni", R_WG, d_W))


def measured_ranges(meeting, frame=0):
    beams, scan = meeting.pattern.beams(frame), meeting.eval()
    p = np.stack([scan["x"], scan["y"], scan["z"]], axis=1).astype(float)
    keys = {
        (ring, t): k
        for k, (ring, t) in enumerate(
            zip(beams.ring.tolist(), beams.t_ns.tolist(), strict=True)
        )
    }
    measured = np.full(len(beams.ring), np.inf)
    for record, distance in zip(scan, np.linalg.norm(p, axis=1), strict=True):
        measured[keys[int(record["ring"]), int(record["t"])]] = distance
    return measured


def compare(meeting, closed_form, least, tolerance=2e-3):
    expected = meeting.expected(closed_form)
    expected[(expected < 0.05) | (expected > 60.0)] = np.inf
    measured = measured_ranges(meeting)
    both = np.isfinite(expected) & np.isfinite(measured)
    assert both.sum() >= least
    # A ray at the outline may hit or miss.
    assert (np.isfinite(expected) != np.isfinite(measured)).sum() <= 4
    error = np.abs(expected[both] - measured[both])
    assert np.median(error) < 1e-4
    # Small errors become large where rays graze the shape.
    assert (error > tolerance).mean() < 0.03


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize(
    ("sensor", "other"),
    [
        (STILL, STILL),
        (SENSOR_V, STILL),
        (STILL, SWUNG),
        (SENSOR_V, SWUNG),
        (STILL, WHIRLING),
    ],
)
def test_each_beam_meets_bodies_where_they_are_then(name, sensor, other):
    shape, closed_form = SHAPES[name]
    meeting = Meeting(shape)
    meeting.move(sensor, other)
    compare(meeting, closed_form, least=60)


def test_a_pattern_that_does_not_repeat():
    shape, closed_form = SHAPES["box"]
    meeting = Meeting(shape, make_beam_pattern("mid-360", min_range=0.05))
    meeting.move(SENSOR_V, SWUNG)
    compare(meeting, closed_form, least=300)


def test_motion_comes_and_goes():
    """A body that has stopped is seen as if it had never moved."""
    meeting = Meeting(SHAPES["box"][0])
    meeting.move(STILL, STILL)
    still = meeting.eval().copy()
    meeting.move(STILL, SWUNG)
    assert len(meeting.eval()) != len(still) or (meeting.eval() != still).any()
    meeting.move(STILL, STILL)
    np.testing.assert_array_equal(meeting.eval(), still)
    without = Meeting(SHAPES["box"][0], motion_distortion=False)
    without.move(SENSOR_V, SWUNG)
    np.testing.assert_array_equal(without.eval(), still)


def test_points_in_the_world_lie_where_they_were_met():
    """The points lie on a still box for any motion of the LiDAR."""
    meeting = Meeting(SHAPES["box"][0])
    meeting.move(SENSOR_V, STILL)
    p_W = meeting.eval("point_cloud_W").xyzs().astype(float)
    p_G = (meeting.X_WBs[1] @ X_BG).inverse() @ p_W
    outside = np.abs(p_G) / [[0.5], [1.0], [0.75]]
    np.testing.assert_allclose(outside.max(axis=0), 1.0, atol=1e-4)
    X_WS = meeting.eval("X_WS")
    assert X_WS.IsNearlyEqualTo(meeting.X_WBs[0] @ X_PS, 1e-12)


def test_it_turns_too_fast():
    meeting = Meeting(SHAPES["box"][0])
    meeting.move(STILL, SpatialVelocity(w=[0, 0, 1e4], v=[0, 0, 0]))
    with pytest.raises(ValueError, match="a body turns by 1000 rad during"):
        meeting.eval()
