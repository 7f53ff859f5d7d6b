"""Hits of scans, and of single rays, where single precision is not enough.

Oracles: triangles in double precision, one by one, and closed meshes, which no
ray leaves.
"""

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

from cns_drake.sensors import DirectionPattern, add_lidar

SLOPE = RollPitchYaw(0.3, 0.4, 0.5)
# What docs/drake.md promises: error of a range [m].
ERROR = 2e-3
# Distance of a point from its triangle [m].
GAP = 1e-3
# Distance from an edge at which a beam may pass on either side [m].
BESIDE = 1e-4


class Scene:
    """Shapes at rest, or on one frame that has been moved; and a LiDAR.

    The LiDAR is at p_WS and its axes are the world's; by default it is where
    the shapes are, and has one beam.
    """

    def __init__(self, shapes, X_WF=None, p_WS=None, d_Wset=((1, 0, 0),)):
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
        if p_WS is None:
            p_WS = (X_WF or shapes[0][1]).translation()
        self.count = len(d_Wset)
        pattern = DirectionPattern(
            d_Wset,
            min_range=0.1,
            max_range=1e3,
            period=0.1,
            rings=np.arange(self.count),
        )
        self.lidar = add_lidar(
            builder,
            graph,
            graph.world_frame_id(),
            RigidTransform(p_WS),
            pattern,
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

    def scan(self):
        """Returns the range of each beam, inf without a return."""
        points = self.lidar.scan_output_port().Eval(self.own)
        ranges = np.full(self.count, np.inf)
        xyz = np.stack([points[axis] for axis in "xyz"], axis=1).astype(float)
        ranges[points["ring"]] = np.linalg.norm(xyz, axis=1)
        return ranges


def write_mesh(path, corners, triangles):
    lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in corners]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles]
    path.write_text("\n".join(lines) + "\n")
    return Mesh(str(path))


def meet_triangle(p, d, corners):
    """Returns how N rays from p meet a triangle, in double precision.

    The ranges at which they meet its plane; their distances from its edges
    (segments); whether they pass inside of it (after Moeller and Trumbore).
    """
    a, b, c = corners
    with np.errstate(divide="ignore", invalid="ignore"):
        h = np.cross(d, c - a)
        det = h @ (b - a)
        u = h @ (p - a) / det
        q = np.cross(p - a, b - a)
        v = d @ q / det
        ranges = q @ (c - a) / det
    beside = np.full(len(d), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        # The nearest point of the edge to each line.
        edge, away = end - start, start - p
        across = edge - (d @ edge)[:, None] * d
        off = away - (d @ away)[:, None] * d
        part = -(off * across).sum(axis=1) / (across * across).sum(axis=1)
        nearest = off + np.clip(part, 0.0, 1.0)[:, None] * across
        beside = np.minimum(beside, np.linalg.norm(nearest, axis=1))
    is_inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (ranges > 0.0)
    return ranges, beside, is_inside


def distance_from(points, corners):
    """Returns the distance of each point from a triangle."""
    a, b, c = corners
    n = np.cross(b - a, c - a)
    n /= np.linalg.norm(n)
    nearest = np.full(len(points), np.inf)
    is_inside = np.ones(len(points), bool)
    for start, end in ((a, b), (b, c), (c, a)):
        edge, away = end - start, points - start
        is_inside &= np.cross(edge, away) @ n >= 0.0
        part = np.clip(away @ edge / (edge @ edge), 0.0, 1.0)
        off = np.linalg.norm(away - part[:, None] * edge, axis=1)
        nearest = np.minimum(nearest, off)
    return np.where(is_inside, np.abs((points - a) @ n), nearest)


@pytest.mark.slow
@pytest.mark.parametrize(
    "is_moving", [pytest.param(False, marks=pytest.mark.night), True]
)
def test_slender_triangles_seen_along_their_plane(tmp_path, is_moving):
    """In single precision, hundreds of beams end up to 9 m beside."""
    rng = np.random.default_rng(7 + is_moving)
    sure = grazing = 0
    for trial in range(12):
        start = rng.uniform(-50.0, 50.0, 3)
        u, v = rng.normal(size=(2, 3))
        u /= np.linalg.norm(u)
        v = np.cross(u, v)
        v *= 10.0 ** rng.uniform(-2.5, 0.0) / np.linalg.norm(v)
        corners = start + np.outer([0.0, rng.uniform(4, 15), 2.0], u)
        corners[2] += v
        mesh = write_mesh(tmp_path / f"{trial}.obj", corners, [(0, 1, 2)])
        n = np.cross(u, v / np.linalg.norm(v))
        back = u * rng.uniform(-1, 1) + v / np.linalg.norm(v)
        back += 10.0 ** rng.uniform(-3.7, -1.0) * n
        p = corners.mean(axis=0) + back * 10.0 ** rng.uniform(0.7, 2.5)
        aims = rng.uniform(-0.2, 1.2, (2, 3000, 1))
        d = start + aims[0] * (corners[1] - start) - p
        d += aims[1] * (corners[2] - start)
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        X = RigidTransform(SLOPE, [30.0, -9.0, 4.0]) if is_moving else None
        X_WF = X or RigidTransform()
        d_W = d @ X_WF.rotation().matrix().T
        scene = Scene([(mesh, RigidTransform())], X, X_WF @ p, d_W)
        ranges = scene.scan()
        expected, beside, is_inside = meet_triangle(p, d, corners)
        met = np.isfinite(ranges)
        points = p + ranges[met, None] * d[met]
        assert distance_from(points, corners).max(initial=0.0) < GAP
        is_sure = beside > BESIDE
        np.testing.assert_array_equal(met[is_sure], is_inside[is_sure])
        is_sure &= is_inside
        np.testing.assert_allclose(
            ranges[is_sure], expected[is_sure], rtol=0.0, atol=ERROR
        )
        sure += is_sure.sum()
        grazing += met.sum()
    assert sure > 700
    assert grazing > 3000


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
    edges = corners[triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)]
    aims = np.concatenate(
        [corners, edges.mean(axis=1), edges[:, 0] * 0.3 + edges[:, 1] * 0.7]
    )
    for p in np.random.default_rng(2).uniform(-5.0, 5.0, (3, 3)):
        away = aims - p
        length = np.linalg.norm(away, axis=1)
        d_W = (away / length[:, None]) @ X.rotation().matrix().T
        ranges = Scene([(mesh, X)], None, X @ p, d_W).scan()
        np.testing.assert_allclose(ranges, length, rtol=0.0, atol=1e-4)


def test_rays_in_the_plane_of_a_face_meet_its_neighbours():
    """From all sides in the planes of a turned box, which they must meet."""
    X = RigidTransform(SLOPE, [3.0, 2.0, 1.0])
    half = np.array([4.0, 3.0, 2.0])
    scene = Scene([(Box(*(2.0 * half)), X)])
    rng = np.random.default_rng(9)
    for axis in range(3):
        for shift, meets in ((2e-4, False), (-2e-4, True)):
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
            np.testing.assert_allclose(
                ranges, entries.max(axis=1), rtol=0.0, atol=ERROR
            )


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
