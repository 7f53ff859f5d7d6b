"""Single rays are right where single precision is not.

Oracles: rational arithmetic, and closed meshes, which no ray leaves.
"""

from fractions import Fraction

from helpers.closed_forms import ellipsoid
import numpy as np
from pydrake.geometry import (
    Box,
    Cylinder,
    Ellipsoid,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    Mesh,
    PerceptionProperties,
    SceneGraph,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.framework import DiagramBuilder
import pytest
from scipy.spatial import ConvexHull

from cns_drake.sensors.lidar.adding import add_lidar
from cns_drake.sensors.lidar.patterns import DirectionPattern

AHEAD = DirectionPattern([[1, 0, 0]], min_range=0.1, max_range=9, period=0.1)
SLOPE = RollPitchYaw(0.3, 0.4, 0.5)


class Scene:
    """Shapes at rest, or on one frame that has been moved."""

    def __init__(self, shapes, X_WF=None):
        builder = DiagramBuilder()
        graph = builder.AddSystem(SceneGraph())
        source = graph.RegisterSource("s")
        frame = graph.world_frame_id()
        if X_WF is not None:
            frame = graph.RegisterFrame(source, GeometryFrame("f"))
        self.ids = []
        for k, (shape, X_FG) in enumerate(shapes):
            made = GeometryInstance(X_FG, shape, f"g{k}")
            made.set_perception_properties(PerceptionProperties())
            self.ids.append(graph.RegisterGeometry(source, frame, made))
        X_WS = X_WF or shapes[0][1]
        self.lidar = add_lidar(
            builder,
            graph,
            graph.world_frame_id(),
            RigidTransform(X_WS.translation()),
            AHEAD,
        )
        diagram = builder.Build()
        context = diagram.CreateDefaultContext()
        if X_WF is not None:
            poses = FramePoseVector()
            poses.set_value(frame, X_WF)
            graph.get_source_pose_port(source).FixValue(
                graph.GetMyContextFromRoot(context), poses
            )
        self.keep = diagram, context
        self.own = self.lidar.GetMyContextFromRoot(context)

    def cast(self, p_W, d_W, max_range=np.inf):
        return self.lidar.CastRays(self.own, p_W, d_W, max_range)


def write_mesh(path, corners, triangles):
    lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in corners]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles]
    path.write_text("\n".join(lines) + "\n")
    return Mesh(str(path))


def exact_hit(p, d, corners):
    """Returns range and least distance from an edge in the plane, or None."""
    a, b, c = ([Fraction(x) for x in corner] for corner in corners.tolist())
    p, d = [Fraction(x) for x in p.tolist()], [Fraction(x) for x in d.tolist()]

    def minus(u, v):
        return [x - y for x, y in zip(u, v, strict=True)]

    def dot(u, v):
        return sum(x * y for x, y in zip(u, v, strict=True))

    def cross(u, v):
        return [
            u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3]
            for i in range(3)
        ]

    n = cross(minus(b, a), minus(c, a))
    along = dot(n, d)
    if along == 0:
        return None
    distance = dot(n, minus(a, p)) / along
    q = [x + distance * y for x, y in zip(p, d, strict=True)]
    insides = []
    for u, v in ((a, b), (b, c), (c, a)):
        edge = minus(v, u)
        area = dot(cross(edge, minus(q, u)), n)
        insides.append(float(area) / float(dot(n, n) * dot(edge, edge)) ** 0.5)
    return float(distance), min(insides)


@pytest.mark.slow
@pytest.mark.parametrize(
    "is_moving", [pytest.param(False, marks=pytest.mark.night), True]
)
def test_slender_triangles_seen_along_their_plane(tmp_path, is_moving):
    rng = np.random.default_rng(7 + is_moving)
    sure = 0
    for trial in range(8):
        start = rng.uniform(-50.0, 50.0, 3)
        u, v = rng.normal(size=(2, 3))
        u /= np.linalg.norm(u)
        v = np.cross(u, v)
        v *= 10.0 ** rng.uniform(-2.5, 0.0) / np.linalg.norm(v)
        corners = start + np.outer([0.0, rng.uniform(4, 15), 2.0], u)
        corners[2] += v
        mesh = write_mesh(tmp_path / f"{trial}.obj", corners, [(0, 1, 2)])
        X_WF = RigidTransform(SLOPE, [30.0, -9.0, 4.0]) if is_moving else None
        scene = Scene([(mesh, RigidTransform())], X_WF)
        n = np.cross(u, v / np.linalg.norm(v))
        count = 150
        aim = corners[0] + rng.uniform(-0.2, 1.2, (count, 1)) * (
            corners[1] - corners[0]
        )
        aim += rng.uniform(-0.2, 1.2, (count, 1)) * (corners[2] - corners[0])
        back = rng.normal(size=(count, 3))
        back -= np.outer(back @ n, n)
        back /= np.linalg.norm(back, axis=1, keepdims=True)
        back += 10.0 ** rng.uniform(-3.7, -0.5, (count, 1)) * n
        p = aim + back * rng.uniform(1.0, 400.0, (count, 1))
        d = aim - p
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        X = X_WF or RigidTransform()
        p_W, d_W = (X @ p.T).T, d @ X.rotation().matrix().T
        ranges = scene.cast(p_W, d_W).ranges.astype(float)
        for k in range(count):
            expected = exact_hit(p[k], d[k], corners)
            if expected is None or abs(expected[1]) < 1e-4:
                continue
            sure += 1
            if expected[0] > 0.0 and expected[1] > 0.0:
                assert ranges[k] == pytest.approx(expected[0], rel=1e-6)
            else:
                assert np.isinf(ranges[k])
    assert sure > 700


def closed_meshes():
    """A box of many squares, and the hull of points on a ball."""
    rng = np.random.default_rng(5)
    on_ball = rng.normal(size=(300, 3))
    on_ball *= 12.0 / np.linalg.norm(on_ball, axis=1, keepdims=True)
    steps = np.linspace(-20.0, 20.0, 9)
    grid = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    shell = grid[np.abs(grid).max(axis=1) == 20.0]
    index = {tuple(corner): k for k, corner in enumerate(shell.tolist())}
    faces = []
    for axis in range(3):
        for side in (-20.0, 20.0):
            for one in range(8):
                for other in range(8):
                    square = []
                    for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        corner = [side] * 3
                        corner[(axis + 1) % 3] = steps[one + i]
                        corner[(axis + 2) % 3] = steps[other + j]
                        square.append(index[tuple(corner)])
                    faces += [square[:3], [square[0], *square[2:]]]
    return (shell, np.array(faces)), (on_ball, ConvexHull(on_ball).simplices)


@pytest.mark.parametrize("kind", [0, 1])
@pytest.mark.parametrize("far", [0.0, 30000.0])
def test_no_ray_leaves_a_closed_mesh(tmp_path, kind, far):
    """Aimed at its vertices, and at its edges."""
    corners, triangles = closed_meshes()[kind]
    mesh = write_mesh(tmp_path / "mesh.obj", corners, triangles)
    X = RigidTransform(SLOPE, [far, -far, 0.0])
    scene = Scene([(mesh, X)])
    edges = corners[triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)]
    aims = np.concatenate(
        [corners, edges.mean(axis=1), edges[:, 0] * 0.3 + edges[:, 1] * 0.7]
    )
    for p in np.random.default_rng(2).uniform(-5.0, 5.0, (3, 3)):
        away = aims - p
        length = np.linalg.norm(away, axis=1)
        d_W = (away / length[:, None]) @ X.rotation().matrix().T
        d_W /= np.linalg.norm(d_W, axis=1, keepdims=True)
        ranges = scene.cast(X @ p, d_W).ranges
        np.testing.assert_allclose(ranges, length, rtol=1e-6, atol=1e-5)


def test_rays_in_the_plane_of_a_face_meet_its_neighbours():
    """From all sides in the planes of a turned box, which they must meet."""
    X = RigidTransform(SLOPE, [3.0, 2.0, 1.0])
    half = np.array([4.0, 3.0, 2.0])
    scene = Scene([(Box(*(2.0 * half)), X)])
    rng = np.random.default_rng(9)
    for axis in range(3):
        for shift, meets in ((0.0, True), (1e-7, False), (-1e-7, True)):
            aim = rng.uniform(-0.9, 0.9, (200, 3)) * half
            aim[:, axis] = half[axis] + shift
            turn = rng.uniform(0.0, 2.0 * np.pi, 200)
            d = np.zeros((200, 3))
            d[:, (axis + 1) % 3], d[:, (axis + 2) % 3] = (
                np.cos(turn),
                np.sin(turn),
            )
            p = aim - 30.0 * d
            d_W = d @ X.rotation().matrix().T
            d_W /= np.linalg.norm(d_W, axis=1, keepdims=True)
            ranges = scene.cast((X @ p.T).T, d_W).ranges
            if not meets:
                assert np.isinf(ranges).all()
                continue
            # The slab of the other two axes.
            with np.errstate(divide="ignore", invalid="ignore"):
                sides = [(s * half - p) / d for s in (-1.0, 1.0)]
            entries = np.minimum(*sides)
            entries[:, axis] = -np.inf
            np.testing.assert_allclose(ranges, entries.max(axis=1), rtol=1e-6)


def test_all_kinds_of_shapes_hide_each_other():
    """Triangles, curved shapes and half spaces; from both sides; limits."""
    rng = np.random.default_rng(11)
    axes = (1.0, 2.0, 1.5)
    X = RigidTransform(SLOPE, [1.0, 2.0, 5.0])
    shapes = [
        (Ellipsoid(*axes), X),
        (Box(6.0, 0.5, 9.0), RigidTransform([4.0, 6.0, 4.0])),
        (HalfSpace(), RigidTransform()),
        (Cylinder(0.1, 0.2), RigidTransform([0.0, 0.0, 20.0])),
    ]
    scene = Scene(shapes)
    p = rng.uniform([-9, -9, 0.5], [14, 14, 12], (3000, 3))
    d = rng.uniform(-3, 8, (3000, 3)) - p
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    X_GW = X.inverse()
    expected = np.full((3, len(p)), np.inf)
    d_G = d @ X_GW.rotation().matrix().T
    expected[0] = ellipsoid((X_GW @ p.T).T, d_G, axes)
    away = p - [4.0, 6.0, 4.0]
    half = np.array([3.0, 0.25, 4.5])
    sides = [(s * half - away) / d for s in (-1.0, 1.0)]
    near = np.minimum(*sides).max(axis=1)
    far = np.maximum(*sides).min(axis=1)
    meets = (near <= far) & (far > 0.0)
    expected[1] = np.where(meets, np.where(near > 0.0, near, far), np.inf)
    expected[2] = np.where(d[:, 2] < 0.0, -p[:, 2] / d[:, 2], np.inf)
    first = expected.argmin(axis=0)
    least = expected.min(axis=0)
    hits = scene.cast(p, d)
    # Curved shapes and half spaces are met in single precision.
    flat = first == 1
    np.testing.assert_allclose(hits.ranges[flat], least[flat], rtol=1e-6)
    np.testing.assert_allclose(hits.ranges, least, rtol=1e-4, atol=2e-4)
    order = np.sort(expected, axis=0)
    clear = np.isfinite(least) & (order[1] > order[0] + 1e-3)
    assert np.unique(first[clear]).tolist() == [0, 1, 2]
    assert clear.sum() > 2000
    for k in np.flatnonzero(clear):
        assert hits.geometry_ids[k] == scene.ids[first[k]]
    assert ((hits.normals_W * d).sum(axis=1)[clear] < 0.0).all()
    assert np.linalg.norm(hits.normals_W[clear], axis=1) == pytest.approx(1.0)
    limits = least + rng.choice([-1e-3, 1e-3], len(least))
    limited = scene.cast(p, d, np.maximum(limits, 0.0)).ranges
    met = limits > least
    np.testing.assert_array_equal(np.isfinite(limited), met & (least < np.inf))
