"""The ray caster against closed forms and against Open3D."""

from helpers.closed_forms import box, capsule, cylinder, ellipsoid
from helpers.surface_geometry import make_geometry
import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake.ray_casting import RayCastingScene
from cns_drake.scene import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    TriangleSurface,
)

WORLD = FrameId.get_new_id()
CAR = FrameId.get_new_id()
X_WG = RigidTransform(RollPitchYaw(0.3, -0.5, 1.1), [4.0, -3.0, 2.0])
SHAPES = {
    "box": (None, lambda p, d: box(p, d, (2.0, 3.0, 1.0))),
    "sphere": (
        EllipsoidSurface((1.5, 1.5, 1.5)),
        lambda p, d: ellipsoid(p, d, (1.5, 1.5, 1.5)),
    ),
    "ellipsoid": (
        EllipsoidSurface((2.0, 0.7, 1.1)),
        lambda p, d: ellipsoid(p, d, (2.0, 0.7, 1.1)),
    ),
    "cylinder": (
        CylinderSurface(0.8, 2.5),
        lambda p, d: cylinder(p, d, 0.8, 2.5),
    ),
    "capsule": (
        CapsuleSurface(0.6, 1.8),
        lambda p, d: capsule(p, d, 0.6, 1.8),
    ),
}


def box_surface(size):
    corners = np.array(
        [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    )
    quads = [
        (0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4),
        (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5),
    ]  # fmt: skip
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return TriangleSurface(corners * np.asarray(size) / 2, np.array(triangles))


def geometry(surface, X_FG=None, frame_id=WORLD):
    return make_geometry(surface, frame_id, X_FG)


def identity(frame_id):
    return RigidTransform()


def rays_towards(center, distance, spread, seed, num=4000):
    """Rays from a sphere around a point to the neighbourhood of that point."""
    rng = np.random.default_rng(seed)
    p = rng.normal(size=(num, 3))
    p = center + distance * p / np.linalg.norm(p, axis=1, keepdims=True)
    d = center + rng.uniform(-spread, spread, (num, 3)) - p
    # What the caster sees is float32: compare with the very same rays.
    d = (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32)
    return p.astype(np.float32).astype(float), d.astype(float)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("distance", [0.05, 5.0, 100.0])
@pytest.mark.parametrize("moving", [False, True])
def test_shape_matches_its_closed_form(name, distance, moving):
    surface, closed_form = SHAPES[name]
    surface = surface or box_surface((2.0, 3.0, 1.0))
    X_WF = RigidTransform(RollPitchYaw(0.1, 0.2, -2.0), [-7.0, 1.0, 0.5])
    pose = X_WF if moving else RigidTransform()
    scene = RayCastingScene(
        [geometry(surface, pose.inverse() @ X_WG, CAR if moving else WORLD)],
        {WORLD},
        lambda frame_id: pose,
    )
    p_W, d_W = rays_towards(X_WG.translation(), distance, 2.0, seed=1)
    X_GW = X_WG.inverse()
    p_G = (X_GW @ p_W.T).T
    d_G = d_W @ X_WG.rotation().matrix()
    expected = closed_form(p_G, d_G)

    hits = scene.cast_rays(p_W, d_W, 300.0, with_normals=True)

    hit = np.isfinite(expected)
    # A ray that grazes within float32's resolution may hit or miss.
    disagree = np.isfinite(hits.ranges) != hit
    assert np.count_nonzero(disagree) <= 2
    both = hit & ~disagree
    assert np.count_nonzero(both) > 100
    error = np.abs(hits.ranges[both] - expected[both])
    assert np.quantile(error, 0.99) < 2e-5 + 2e-7 * distance
    # Nearly tangential rays amplify float32's rounding of the surface.
    assert error.max() < 2e-3
    assert (hits.geometry[both] == 0).all()
    assert (hits.geometry[~hit & ~disagree] == -1).all()
    normals = hits.normals_W[both]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
    assert (np.einsum("ij,ij->i", normals, d_W[both]) <= 1e-6).all()


def test_ellipsoid_normal_is_the_gradient():
    semi_axes = np.array([2.0, 0.7, 1.1])
    scene = RayCastingScene(
        [geometry(EllipsoidSurface(tuple(semi_axes)), X_WG)], {WORLD}, identity
    )
    p_W, d_W = rays_towards(X_WG.translation(), 6.0, 0.3, seed=2)
    hits = scene.cast_rays(p_W, d_W, 100.0, with_normals=True)
    p_GH = (X_WG.inverse() @ (p_W + hits.ranges[:, None] * d_W).T).T
    gradient = p_GH / semi_axes**2 @ X_WG.rotation().matrix().T
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    np.testing.assert_allclose(hits.normals_W, gradient, atol=2e-4)


def test_moving_frames_are_where_they_were_put():
    sphere = geometry(EllipsoidSurface((1.0,) * 3), frame_id=CAR)
    wall = geometry(
        box_surface((1.0, 40.0, 40.0)), RigidTransform([20.5, 0.0, 0.0])
    )
    poses = {WORLD: RigidTransform(), CAR: RigidTransform([5.0, 0.0, 0.0])}
    scene = RayCastingScene([wall, sphere], {WORLD}, poses.get)
    ray = (np.zeros(3), np.array([[1.0, 0.0, 0.0]]), 100.0)
    hits = scene.cast_rays(*ray)
    assert hits.ranges[0] == pytest.approx(4.0, abs=1e-6)
    assert hits.geometry[0] == 1
    poses[CAR] = RigidTransform([9.0, 0.25, 0.0])
    scene.set_frame_poses(poses.get)
    hits = scene.cast_rays(*ray)
    assert hits.ranges[0] == pytest.approx(9 - np.sqrt(1 - 0.25**2), abs=1e-5)
    poses[CAR] = RigidTransform([9.0, 5.0, 0.0])
    scene.set_frame_poses(poses.get)
    hits = scene.cast_rays(*ray)
    assert hits.ranges[0] == pytest.approx(20.0, abs=1e-5)
    assert hits.geometry[0] == 0


def test_far_from_the_origin_coordinates_keep_their_precision():
    offset = RigidTransform([331_000.0, 4_027_000.0, 50.0])  # As in UTM.
    scene = RayCastingScene(
        [geometry(box_surface((10.0, 8.0, 6.0)), offset)], {WORLD}, identity
    )
    rng = np.random.default_rng(3)
    d = rng.normal(size=(1000, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    p = np.array([1.0, -2.0, 0.5])
    hits = scene.cast_rays(offset.translation() + p, d, 100.0)
    np.testing.assert_allclose(
        hits.ranges, box(p, d, (10.0, 8.0, 6.0)), atol=2e-5
    )


def test_no_ray_leaks_through_shared_edges():
    """From inside a finely cut sphere, aimed at points of its edges."""
    num = 60
    polar = np.linspace(0.0, np.pi, num)
    around = np.linspace(0.0, 2.0 * np.pi, 2 * num, endpoint=False)
    grid = np.stack(
        [
            np.outer(np.sin(polar), np.cos(around)),
            np.outer(np.sin(polar), np.sin(around)),
            np.outer(np.cos(polar), np.ones_like(around)),
        ],
        axis=-1,
    )
    grid[[0, -1], :, :2] = 0.0  # One point at each pole, not a tiny circle.
    grid = grid.reshape(-1, 3)
    rows, columns = np.meshgrid(np.arange(num - 1), np.arange(2 * num))
    a = (rows * 2 * num + columns).ravel()
    b = (rows * 2 * num + (columns + 1) % (2 * num)).ravel()
    c, d = a + 2 * num, b + 2 * num
    triangles = np.concatenate(
        [np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1)]
    )
    scene = RayCastingScene(
        [geometry(TriangleSurface(50.0 * grid, triangles))], {WORLD}, identity
    )
    along = np.random.default_rng(6).uniform(0.01, 0.99, (len(a), 1))
    edges = np.concatenate(
        [
            along * grid[first] + (1.0 - along) * grid[second]
            for first, second in [(a, b), (a, c), (b, c)]
        ]
    )
    edges /= np.linalg.norm(edges, axis=1, keepdims=True)
    hits = scene.cast_rays(np.zeros(3), edges, 200.0)
    assert np.isfinite(hits.ranges).all()


@pytest.mark.parametrize("num_rays", [0, 1, 15, 16, 17, 33])
def test_any_number_of_rays(num_rays):
    scene = RayCastingScene(
        [geometry(box_surface((4.0, 4.0, 4.0)))], {WORLD}, identity
    )
    rng = np.random.default_rng(4)
    d = rng.normal(size=(num_rays, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    hits = scene.cast_rays(np.zeros(3), d, 10.0)
    np.testing.assert_allclose(
        hits.ranges, box(np.zeros(3), d, (4.0, 4.0, 4.0)), atol=1e-6
    )


def test_origins_and_directions_must_match():
    scene = RayCastingScene(
        [geometry(box_surface((4.0, 4.0, 4.0)))], {WORLD}, identity
    )
    with pytest.raises(ValueError, match="2 origins for 3 rays"):
        scene.cast_rays(np.zeros((2, 3)), np.eye(3), 10.0)


def test_agrees_with_open3d_on_triangle_soup():
    import open3d

    rng = np.random.default_rng(5)
    centers = rng.uniform(-40.0, 40.0, (6000, 1, 3))
    corners = centers + rng.normal(scale=1.5, size=(6000, 3, 3))
    triangles = np.arange(18000).reshape(-1, 3)
    surfaces = [
        TriangleSurface(corners[k::3].reshape(-1, 3), triangles[:2000])
        for k in range(3)
    ]
    scene = RayCastingScene(
        [geometry(surface) for surface in surfaces], {WORLD}, identity
    )
    d = rng.normal(size=(20000, 3))
    d = (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32)
    p = np.array([1.0, 2.0, 3.0])
    hits = scene.cast_rays(p, d, 1000.0)

    oracle = open3d.t.geometry.RaycastingScene()
    for surface in surfaces:
        oracle.add_triangles(
            open3d.core.Tensor(surface.p_GVset.astype(np.float32)),
            open3d.core.Tensor(surface.triangles.astype(np.uint32)),
        )
    rays = np.concatenate([np.broadcast_to(p, d.shape), d], axis=1)
    answer = oracle.cast_rays(open3d.core.Tensor(rays.astype(np.float32)))
    expected = answer["t_hit"].numpy()
    np.testing.assert_array_equal(
        np.isfinite(hits.ranges), np.isfinite(expected)
    )
    hit = np.isfinite(expected)
    np.testing.assert_allclose(hits.ranges[hit], expected[hit], atol=1e-4)
    ids = answer["geometry_ids"].numpy()[hit].astype(int)
    # Triangles may touch: the same range may belong to either.
    assert np.mean(hits.geometry[hit] == ids) > 0.999


@pytest.mark.parametrize("num_rays", [0, 1, 17, 2048, 2049, 9001])
def test_threads_change_nothing(num_rays):
    rng = np.random.default_rng(num_rays)
    geometries = [
        geometry(surface or box_surface((2, 3, 1)), RigidTransform([9, k, 0]))
        for k, (surface, _) in enumerate(SHAPES.values())
    ]
    origins = rng.normal(size=(num_rays, 3))
    d = rng.normal(size=(num_rays, 3)) * 0.2 + [1, 0.2, 0]
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    one, three = (
        RayCastingScene(geometries, {WORLD}, identity, num_threads=n).cast_rays(
            origins, d, 50.0, with_normals=True
        )
        for n in (1, 3)
    )
    assert num_rays < 17 or np.isfinite(one.ranges).any()
    np.testing.assert_array_equal(one.ranges, three.ranges)
    np.testing.assert_array_equal(one.geometry, three.geometry)
    np.testing.assert_array_equal(one.normals_W, three.normals_W)


@pytest.mark.parametrize(
    ("num_positions", "num_frames"), [(1, 6), (6, 1), (3, 2)]
)
def test_poses_are_taken_in_turn(num_positions, num_frames):
    """The results are those of rays given in the world."""
    rng = np.random.default_rng(7)
    scene = RayCastingScene(
        [
            geometry(surface or box_surface((2.0, 3.0, 1.0)), X_WG)
            for surface, _ in SHAPES.values()
        ],
        {WORLD},
        identity,
    )
    p = rng.normal(size=(num_positions, 3))
    R = np.array(
        [
            RollPitchYaw(*rng.uniform(-3, 3, 3)).ToRotationMatrix().matrix()
            for _ in range(num_frames)
        ]
    )
    d = X_WG.translation() + rng.normal(size=(600, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    rows = np.arange(600)
    d_S = np.einsum("nij,ni->nj", R[rows % num_frames], d)
    hits = scene.cast_rays(p, d_S, 50.0, R_WSset=R, with_normals=True)
    expected = scene.cast_rays(
        p[rows % num_positions], d, 50.0, with_normals=True
    )
    same = hits.geometry == expected.geometry
    assert same.mean() > 0.99
    assert np.isfinite(hits.ranges).sum() > 200
    hit = same & (hits.geometry >= 0)
    error = np.abs(hits.ranges[hit] - expected.ranges[hit])
    assert np.quantile(error, 0.98) < 2e-5
    cosine = np.einsum("ij,ij->i", hits.normals_W, expected.normals_W)[hit]
    assert np.quantile(cosine, 0.02) > 1 - 1e-5


@pytest.mark.parametrize("tiny", [-5e-19, 5e-19, -1e-30, -0.0, 0.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_ray_that_hardly_leaves_a_plane(axis, tiny):
    """The other rays of its packet stay right."""
    walls = []
    for k in range(3):
        for side in (-1, 1):
            size = np.full(3, 30.0)
            place = np.zeros(3)
            size[k], place[k] = 1.0, side * 5.0
            walls.append(geometry(box_surface(size), RigidTransform(place)))
    scene = RayCastingScene(walls, {WORLD}, identity)
    d = np.tile(np.roll([0.0, -0.8, 0.6], axis), (16, 1))
    d[:, axis] = -0.01 * np.arange(16)
    d[0, axis] = tiny
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    p = np.array([0.7, 0.2, -0.4])
    hits = scene.cast_rays(p, d, 100.0)
    expected = box(p, d, (9.0, 9.0, 9.0))
    np.testing.assert_allclose(hits.ranges, expected, rtol=1e-5)


def test_the_first_of_two_shapes_in_one_place_is_hit():
    """However slender, and whichever way its corners run."""
    corners = np.array([[0, 0, 0], [600, 0, 0], [500, 4, 0]], float)
    runs = ((0, 1, 2), (1, 0, 2), (2, 1, 0))
    shapes = [
        geometry(TriangleSurface(corners, np.array([run]))) for run in runs
    ]
    p = np.mgrid[10:590:8, 0:4, 2:3].reshape(3, -1).T.astype(float)
    p = p[p[:, 1] * 500 < p[:, 0] * 4 - 40]
    p = p[p[:, 1] * 100 < 4 * (600 - p[:, 0]) - 40]
    down = np.tile([0.0, 0.0, -1.0], (len(p), 1))
    for order in ([0, 1, 2], [1, 0, 2], [2, 1, 0]):
        scene = RayCastingScene(
            [shapes[k] for k in order], {WORLD}, identity, p_WS=np.zeros(3)
        )
        hits = scene.cast_rays(p, down, 10.0)
        assert (hits.ranges == 2.0).all()
        assert (hits.geometry == 0).all()
