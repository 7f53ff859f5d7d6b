"""Every shape of a SceneGraph, against SceneGraph's own measurements."""

from helpers.drake_distances import marched_range
from helpers.lidar_stage import (
    FORWARD,
    X_WS,
    Stage,
    ahead,
    beam_index,
    positions,
)
from helpers.mesh_texts import gltf_text, obj_text
import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import (
    Box,
    Capsule,
    ClippingRange,
    Convex,
    Cylinder,
    DepthRange,
    DepthRenderCamera,
    Ellipsoid,
    GeometryInstance,
    HalfSpace,
    IllustrationProperties,
    InMemoryMesh,
    MakeRenderEngineVtk,
    Mesh,
    MeshcatCone,
    PerceptionProperties,
    ProximityProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    RenderLabel,
    Rgba,
    Role,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.systems.sensors import CameraInfo
import pytest

from cns_drake.ray_casting import RayCastingScene
from cns_drake.scene import read_perception_geometry
from cns_drake.sensors import Lidar, SpinningPattern, connect_lidar

X_WG = RigidTransform(RollPitchYaw(0.4, -0.3, 1.9), [-4.0, 2.5, 0.8])
PATTERN = SpinningPattern(
    tuple(np.linspace(0.5, -0.5, 24)), 180, 0.1, 60.0, 0.05
)
NODES = (
    {"children": [1], "translation": [0.5, 0.0, -1.0]},
    {"mesh": 0, "scale": [1.0, 2.0, 0.5], "rotation": [0.6, 0.0, 0.0, 0.8]},
)


@pytest.fixture
def meshes(tmp_path):
    """Files of meshes by ending."""
    (tmp_path / "mesh.obj").write_text(obj_text())
    (tmp_path / "mesh.gltf").write_text(gltf_text(NODES)[0])
    return {e: tmp_path / f"mesh.{e}" for e in ("obj", "gltf")}


def points(count=20):
    return np.random.default_rng(5).normal(size=(3, count))


# Shapes to which SceneGraph measures distances.
SHAPES = {
    "box": lambda meshes: Box(1.0, 2.0, 3.0),
    "sphere": lambda meshes: Sphere(1.2),
    "ellipsoid": lambda meshes: Ellipsoid(0.5, 1.5, 2.0),
    "cylinder": lambda meshes: Cylinder(0.7, 2.5),
    "capsule": lambda meshes: Capsule(0.6, 1.8),
    "half space": lambda meshes: HalfSpace(),
    "convex of points": lambda meshes: Convex(points(), "points", 0.7),
    "convex OBJ": lambda meshes: Convex(meshes["obj"], [1.0, 0.6, 1.7]),
    "convex glTF": lambda meshes: Convex(meshes["gltf"], [1.0, 0.6, -1.7]),
    "OBJ": lambda meshes: Mesh(meshes["obj"]),
    "OBJ, scaled": lambda meshes: Mesh(meshes["obj"], [0.5, 2.0, 1.3]),
    "OBJ, mirrored": lambda meshes: Mesh(meshes["obj"], [-0.5, 2.0, 1.3]),
}


def add_proximity(stage, shape):
    instance = GeometryInstance(X_WG, shape, "thing")
    instance.set_proximity_properties(ProximityProperties())
    return stage.scene_graph.RegisterAnchoredGeometry(stage.source, instance)


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_is_where_drake_measures_it(name, meshes):
    """Sphere tracing by SceneGraph's signed distances is the oracle."""
    stage = Stage()
    add_proximity(stage, SHAPES[name](meshes))
    stage.finish(pattern=PATTERN, role=Role.kProximity)
    scan = stage.eval()
    query_object = stage.scene_graph.get_query_output_port().Eval(
        stage.scene_graph.GetMyContextFromRoot(stage.context)
    )
    measured = np.full(PATTERN.num_beams, np.inf)
    measured[beam_index(scan, PATTERN)] = np.linalg.norm(
        positions(scan), axis=1
    )
    hit = np.flatnonzero(np.isfinite(measured))
    missed = np.flatnonzero(~np.isfinite(measured))
    assert len(hit) > 8
    rng = np.random.default_rng(3)
    d_Wset = PATTERN.d_Sset @ X_WS.rotation().matrix().T
    differing = 0
    for beam in [*rng.choice(hit, 8), *rng.choice(missed, 4)]:
        expected = marched_range(
            query_object, X_WS.translation(), d_Wset[beam], 60.0
        )
        # Tracing stops before surfaces that it grazes.
        differing += not np.isclose(expected, measured[beam], atol=2e-3)
    assert differing <= 1


@pytest.mark.sampled(1)
@pytest.mark.slow
@pytest.mark.parametrize("scale", [[1.0, 1.0, 1.0], [0.5, 2.0, -1.3]])
def test_a_gltf_mesh_is_where_drake_renders_it(scale, meshes):
    """The depth image of Drake's renderer is the oracle."""
    stage = Stage()
    try:
        renderer = MakeRenderEngineVtk(RenderEngineVtkParams())
    except RuntimeError as error:
        pytest.skip(f"no rendering here: {error}")
    stage.scene_graph.AddRenderer("vtk", renderer)
    instance = GeometryInstance(X_WG, Mesh(meshes["gltf"], scale), "thing")
    properties = PerceptionProperties()
    properties.AddProperty("label", "id", RenderLabel(1))
    instance.set_perception_properties(properties)
    stage.scene_graph.RegisterAnchoredGeometry(stage.source, instance)
    camera = CameraInfo(width=120, height=90, fov_y=0.7)
    # Ahead is z for a camera, its rows go down. What VTK draws in a pixel is
    # half a pixel farther right and down than `CameraInfo` has it.
    u, v = np.meshgrid(np.arange(120) + 0.5, np.arange(90) + 0.5)
    d_C = np.stack(
        [
            (u - camera.center_x()) / camera.focal_x(),
            (v - camera.center_y()) / camera.focal_y(),
            np.ones_like(u),
        ],
        axis=-1,
    ).reshape(-1, 3)
    p_WC = np.array([-1.0, -4.0, 3.0])
    X_WC = RigidTransform(look_at(X_WG.translation() - p_WC), p_WC)
    stage.finish()
    query_object = stage.scene_graph.get_query_output_port().Eval(
        stage.scene_graph.GetMyContextFromRoot(stage.context)
    )
    depth = query_object.RenderDepthImage(
        DepthRenderCamera(
            RenderCameraCore(
                "vtk", camera, ClippingRange(0.05, 50.0), RigidTransform()
            ),
            DepthRange(0.1, 40.0),
        ),
        stage.scene_graph.world_frame_id(),
        X_WC,
    ).data[:, :, 0]
    scale_of_d = np.linalg.norm(d_C, axis=1, keepdims=True)
    inspector = query_object.inspector()
    scene = RayCastingScene(
        read_perception_geometry(inspector),
        {inspector.world_frame_id()},
        query_object.GetPoseInWorld,
    )
    hits = scene.cast_rays(
        X_WC.translation(),
        d_C / scale_of_d,
        40.0,
        R_WSset=X_WC.rotation().matrix(),
    )
    cast = (hits.ranges / scale_of_d[:, 0]).reshape(depth.shape)
    rendered, seen = np.isfinite(depth), np.isfinite(cast)
    assert seen.sum() > 500
    # A pixel at an edge may show either side.
    assert (rendered != seen).mean() < 0.01
    error = np.abs(depth[rendered & seen] - cast[rendered & seen])
    assert np.median(error) < 1e-5
    assert (error > 1e-4).mean() < 0.01


def look_at(d_W):
    """The orientation of a camera that looks along a direction."""
    z = d_W / np.linalg.norm(d_W)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return RotationMatrix(np.column_stack([x, np.cross(z, x), z]))


@pytest.mark.sampled(1)
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["obj", "gltf"])
def test_a_mesh_in_memory_is_that_of_the_file(kind, meshes, tmp_path):
    if kind == "gltf":
        text, data = gltf_text(NODES, uri="parts/mesh.bin")
        files = {"parts/mesh.bin": MemoryFile(data, ".bin", "bin")}
    else:
        text = meshes[kind].read_text()
        files = {}
    in_memory = InMemoryMesh(
        mesh_file=MemoryFile(text, f".{kind}", "mesh"), supporting_files=files
    )
    scans = []
    for shape in (Mesh(meshes[kind]), Mesh(in_memory)):
        stage = Stage()
        stage.add("thing", shape, X_WG)
        scans.append(stage.finish(pattern=PATTERN).eval())
    assert len(scans[0]) > 8
    np.testing.assert_array_equal(*scans)


def test_a_cone_of_an_illustration():
    """Its radius along x, at two metres from the point, in closed form."""
    stage = Stage()
    instance = GeometryInstance(
        RigidTransform([10.0, 0.0, -2.0]), MeshcatCone(4.0, 3.0, 1.0), "cone"
    )
    instance.set_illustration_properties(IllustrationProperties())
    stage.scene_graph.RegisterAnchoredGeometry(stage.source, instance)
    stage.finish(
        X_PS=RigidTransform(), pattern=FORWARD, role=Role.kIllustration
    )
    assert ahead(stage.eval()) == pytest.approx(8.5, rel=1e-4)


def test_a_half_space_that_moves():
    """A plane that a body carries, from above and from below."""
    stage = Stage()
    plate = stage.add_frame("plate", 5, RigidTransform())
    stage.add("plane", HalfSpace(), frame=plate)
    stage.finish(pattern=PATTERN)
    for X_WF in (
        RigidTransform(RollPitchYaw(0.3, -0.2, 0.5), [1.0, 2.0, -3.0]),
        RigidTransform(RollPitchYaw(0.3, 2.9, 0.5), [1.0, 2.0, 1.0]),
    ):
        stage.poses[plate] = X_WF
        stage.set_poses()
        scan = stage.eval()
        n_W = X_WF.rotation().matrix()[:, 2]
        d_W = PATTERN.d_Sset @ X_WS.rotation().matrix().T
        height = (X_WF.translation() - X_WS.translation()) @ n_W
        expected = height / (d_W @ n_W)
        hit = (expected >= 0.1) & (expected <= 60.0)
        beams = beam_index(scan, PATTERN)
        np.testing.assert_array_equal(beams, np.flatnonzero(hit))
        measured = np.linalg.norm(positions(scan), axis=1)
        np.testing.assert_allclose(measured, expected[beams], rtol=1e-5)


def test_a_half_space_and_a_box_that_move():
    stage = Stage()
    plate = stage.add_frame("plate", 5, RigidTransform())
    cart = stage.add_frame("cart", 6, RigidTransform())
    stage.add("plane", HalfSpace(), frame=plate)
    stage.add("box", Box(2.0, 2.0, 2.0), frame=cart)
    stage.finish(X_PS=RigidTransform(), pattern=FORWARD)
    towards_sensor = RollPitchYaw(0.0, -np.pi / 2, 0.0)
    for plane, box, expected in (
        (30.0, 12.0, 11.0),
        (25.0, 40.0, 25.0),
        (20.0, 14.0, 13.0),
        (15.0, -12.0, 15.0),
    ):
        stage.poses[plate] = RigidTransform(towards_sensor, [plane, 0.0, 0.0])
        stage.poses[cart] = RigidTransform([box, 0.0, 0.0])
        stage.set_poses()
        assert ahead(stage.eval()) == pytest.approx(expected, rel=1e-5)


def test_deformable_geometry_is_left_out():
    def add_jelly():
        instance = GeometryInstance(RigidTransform(), Sphere(1.0), "jelly")
        instance.set_perception_properties(PerceptionProperties())
        stage = Stage()
        jelly = stage.scene_graph.RegisterDeformableGeometry(
            stage.source, stage.scene_graph.world_frame_id(), instance, 0.5
        )
        wall = RigidTransform([20.5, 0.0, 0.0])
        stage.add("wall", Box(1.0, 9.0, 9.0), wall)
        return stage, jelly

    stage, _ = add_jelly()
    stage.finish(X_PS=RigidTransform(), pattern=FORWARD)
    with pytest.warns(UserWarning, match=r"geometry 'jelly': .*deformable"):
        assert ahead(stage.eval()) == pytest.approx(20.0, abs=1e-5)
    stage.add_to_context(
        stage.scene_graph.world_frame_id(), Box(12.0, 9.0, 9.0)
    )
    # Told once.
    assert ahead(stage.eval()) == pytest.approx(6.0, abs=1e-5)
    stage, jelly = add_jelly()
    stage.finish(X_PS=RigidTransform(), pattern=FORWARD, unseen=[jelly])
    assert ahead(stage.eval()) == pytest.approx(20.0, abs=1e-5)


@pytest.mark.parametrize("alpha", [0.0, 1.0])
def test_what_is_not_rendered_is_not_seen(alpha):
    """Alpha hides nothing, as in Drake's depth images."""
    stage = Stage()
    for x, label in ((5.5, RenderLabel.kDoNotRender), (9.5, RenderLabel(7))):
        properties = PerceptionProperties()
        properties.AddProperty("label", "id", label)
        properties.AddProperty("phong", "diffuse", Rgba(1, 1, 1, alpha))
        pose = RigidTransform([x, 0.0, 0.0])
        instance = GeometryInstance(pose, Box(1.0, 9.0, 9.0), f"wall_{x}")
        instance.set_perception_properties(properties)
        stage.scene_graph.RegisterAnchoredGeometry(stage.source, instance)
    stage.finish(X_PS=RigidTransform(), pattern=FORWARD)
    assert ahead(stage.eval()) == pytest.approx(9.0, abs=1e-5)


def test_it_sees_the_chosen_role():
    stage = Stage()
    for distance, role, properties in (
        (5, "proximity", ProximityProperties()),
        (10, "illustration", IllustrationProperties()),
        (15, "perception", PerceptionProperties()),
    ):
        wall = GeometryInstance(
            RigidTransform([distance + 0.5, 0, 0]), Box(1, 9, 9), role
        )
        getattr(wall, f"set_{role}_properties")(properties)
        stage.scene_graph.RegisterAnchoredGeometry(stage.source, wall)
    roles = (Role.kProximity, Role.kIllustration, Role.kPerception)
    found = []
    for role in roles:
        lidar = stage.builder.AddSystem(
            Lidar(
                stage.scene_graph.world_frame_id(),
                RigidTransform(),
                FORWARD,
                role=role,
            )
        )
        lidar.set_name(str(role))
        connect_lidar(stage.builder, stage.scene_graph, lidar)
        found.append(lidar)
    context = stage.builder.Build().CreateDefaultContext()
    ranges = [
        ahead(
            lidar.GetOutputPort("scan").Eval(
                lidar.GetMyContextFromRoot(context)
            )
        )
        for lidar in found
    ]
    assert ranges == pytest.approx([5.0, 10.0, 15.0], abs=1e-5)
