"""Ray casters on one stage: rays a second, and errors.

    pip install "cns-drake[benchmark]"
    python tests/benchmarks/peers.py [DRIVE] [--rounds N] [--poses N]

The triangles of a stage, without curved shapes, which not every caster knows,
and the same 32 x 1024 rays in float32 from poses along the drive, up to
120 m, on one thread as far as a caster can be told (its CPU time counts).
Errors are against the distance, in float64, to the plane of the triangle that
Open3D's Embree says a ray meets first. Rays that meet something in one and
not in the other, and those more than 5 mm off, are counted; at silhouettes
rounding alone may decide which it is.

Drake renders depth: of four square views the pixel nearest to a ray counts,
and as that is another ray, errors of centimetres are in the nature of it.

Casters that are not installed, or that do not run here, are named.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
import tempfile

import numpy as np
import open3d
from pydrake.geometry import (
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    FrameId,
    GeometryId,
    GeometryInstance,
    MakeRenderEngineVtk,
    Mesh,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    RenderLabel,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.sensors import CameraInfo
from stages import interleaved, read_stage, sensor_poses, still

from cns_drake.ray_casting import RayCastingScene
from cns_drake.scene import PerceptionGeometry, TriangleSurface
from cns_drake.sensors import make_beam_pattern

REACH = 120.0
# Errors beyond this are counted [m].
APART = 5e-3
# MuJoCo takes meshes of a limited size.
_MESH_TRIANGLES = 100_000
# PyBullet loses rays of a batch of 16,384 or more.
_BATCH = 16_000
# Pixels of a side of a rendered view.
_PIXELS = 512


@dataclass(frozen=True)
class Stage:
    """What is cast.

    Attributes:
        vertices: (N, 3) float32 positions [m].
        triangles: (M, 3) int32 vertex indices.
        origins: (P, 3) float32 where the rays of each scan start [m].
        directions: (P, R, 3) float32 unit directions.
        obj: the triangles as a file, with normals.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    obj: Path

    @property
    def scans(self):
        return zip(self.origins, self.directions, strict=True)


# Takes an origin and (R, 3) directions, gives (R,) ranges, inf for a miss.
Caster = Callable[[np.ndarray, np.ndarray], np.ndarray]


def make_stage(drive: str, num_poses: int, folder: Path) -> Stage:
    """Returns a drive's stage and rays; O is the middle of its poses."""
    poses = sensor_poses(drive, num_poses)
    p_WO = np.round(np.mean([X_WS.translation() for X_WS in poses], axis=0))
    vertices = []
    triangles = []
    count = 0
    for geometry in read_stage(drive):
        if isinstance(geometry.surface, TriangleSurface):
            p_WVset = geometry.X_FG.multiply(geometry.surface.p_GVset.T).T
            vertices.append(p_WVset - p_WO)
            triangles.append(geometry.surface.triangles + count)
            count += len(p_WVset)
    pattern = make_beam_pattern("cns", 0.05)
    d_Sset = pattern.d_Sset[pattern.beams(0).packet_order]
    stage = Stage(
        np.concatenate(vertices).astype(np.float32),
        np.concatenate(triangles).astype(np.int32),
        np.array([X.translation() - p_WO for X in poses], np.float32),
        np.array([d_Sset @ X.rotation().matrix().T for X in poses], np.float32),
        folder / "stage.obj",
    )
    _write_obj(stage)
    return stage


def _write_obj(stage: Stage) -> None:
    """Writes the triangles, with normals, which Drake's renderer demands."""
    normals = _normals(stage)
    normals /= np.maximum(np.linalg.norm(normals, axis=1)[:, None], 1e-12)
    number = np.arange(1, len(normals) + 1)[:, None]
    corners = np.stack([stage.triangles + 1, np.tile(number, 3)], axis=2)
    with open(stage.obj, "w") as stream:
        for letters, values in (("v", stage.vertices), ("vn", normals)):
            np.savetxt(stream, values, f"{letters} %.9g %.9g %.9g")
        face = "f %d//%d %d//%d %d//%d"
        np.savetxt(stream, corners.reshape(-1, 6), face)


def _normals(stage: Stage) -> np.ndarray:
    """Returns the (M, 3) float64 normals of triangles, of any length."""
    a, b, c = np.moveaxis(stage.vertices.astype(float)[stage.triangles], 1, 0)
    return np.cross(b - a, c - a)


def cns_drake(stage: Stage) -> Caster:
    """This project's caster."""
    surface = TriangleSurface(stage.vertices.astype(float), stage.triangles)
    frame = FrameId.get_new_id()
    geometry = PerceptionGeometry(
        GeometryId.get_new_id(), "stage", frame, RigidTransform(), surface, None
    )
    scene = RayCastingScene([geometry], {frame}, still)
    return lambda p, d: scene.cast_rays(p, d, REACH).ranges


def open3d_scene(stage: Stage) -> open3d.t.geometry.RaycastingScene:
    """The stage in Open3D."""
    scene = open3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(
        open3d.core.Tensor(stage.vertices),
        open3d.core.Tensor(stage.triangles.astype(np.uint32)),
    )
    return scene


def open3d_rays(p: np.ndarray, d: np.ndarray) -> open3d.core.Tensor:
    """Rays in Open3D."""
    rays = np.empty((len(d), 6), np.float32)
    rays[:, :3], rays[:, 3:] = p, d
    return open3d.core.Tensor.from_numpy(rays)


def open3d_caster(stage: Stage) -> Caster:
    """Open3D's `cast_rays`."""
    scene = open3d_scene(stage)

    def cast(p, d):
        ranges = scene.cast_rays(open3d_rays(p, d), nthreads=1)["t_hit"]
        return ranges.numpy()

    return cast


def embreex_caster(stage: Stage) -> Caster:
    """The Embree binding that trimesh uses."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene()
    mesh = TriangleMesh(scene, stage.vertices, stage.triangles)

    def cast(p, d, mesh=mesh):  # The mesh lives as long as its caster.
        origins = np.tile(p, (len(d), 1))
        ranges = scene.run(origins, d, query="DISTANCE", dists=REACH)
        return np.where(ranges < REACH, ranges, np.inf)

    return cast


def mujoco_caster(stage: Stage) -> Caster:
    """MuJoCo's `mj_multiRay`, the stage in as few meshes as it takes."""
    import mujoco

    spec = mujoco.MjSpec()
    for start in range(0, len(stage.triangles), _MESH_TRIANGLES):
        part = stage.triangles[start : start + _MESH_TRIANGLES]
        used, faces = np.unique(part, return_inverse=True)
        name = f"part_{start}"
        mesh = spec.add_mesh(name=name)
        mesh.uservert = stage.vertices[used].ravel()
        mesh.userface = faces.ravel().astype(np.int32)
        # A stage is no solid, which has a volume.
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            contype=0,
            conaffinity=0,
        )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)

    def cast(p, d):
        ranges = np.empty(len(d))
        mujoco.mj_multiRay(
            model,
            data,
            p.astype(float)[:, None],
            d.astype(float).reshape(-1, 1),
            None,
            True,
            -1,
            np.empty((len(d), 1), np.int32),
            ranges[:, None],
            None,
            len(d),
            REACH,
        )
        return np.where(ranges >= 0.0, ranges, np.inf)

    return cast


def pybullet_caster(stage: Stage) -> Caster:
    """PyBullet's `rayTestBatch`."""
    import pybullet

    client = pybullet.connect(pybullet.DIRECT)
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_MESH,
        fileName=str(stage.obj),
        flags=pybullet.GEOM_FORCE_CONCAVE_TRIMESH,
        physicsClientId=client,
    )
    pybullet.createMultiBody(0, shape, physicsClientId=client)

    def cast(p, d):
        origins = np.tile(p, (len(d), 1))
        ends = p + REACH * d
        ranges = []
        for start in range(0, len(d), _BATCH):
            block = slice(start, start + _BATCH)
            hits = pybullet.rayTestBatch(
                origins[block].tolist(),
                ends[block].tolist(),
                numThreads=1,
                physicsClientId=client,
            )
            ranges += [
                REACH * hit[2] if hit[0] >= 0 else np.inf for hit in hits
            ]
        return np.array(ranges)

    return cast


def drake_depth(stage: Stage) -> Caster:
    """Drake's rendered depth: four square views side by side."""
    scene_graph = SceneGraph()
    scene_graph.AddRenderer("vtk", MakeRenderEngineVtk(RenderEngineVtkParams()))
    source = scene_graph.RegisterSource("stage")
    instance = GeometryInstance(RigidTransform(), Mesh(str(stage.obj)), "stage")
    properties = PerceptionProperties()
    properties.AddProperty("label", "id", RenderLabel(1))
    instance.set_perception_properties(properties)
    scene_graph.RegisterAnchoredGeometry(source, instance)
    context = scene_graph.CreateDefaultContext()
    camera = DepthRenderCamera(
        RenderCameraCore(
            "vtk",
            CameraInfo(_PIXELS, _PIXELS, np.pi / 2),
            ClippingRange(0.1, 2.0 * REACH),
            RigidTransform(),
        ),
        DepthRange(0.2, 1.5 * REACH),
    )
    world = scene_graph.world_frame_id()
    # Cameras look along z, with y downwards.
    ahead = RotationMatrix([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    views = [
        RotationMatrix.MakeZRotation(k * np.pi / 2) @ ahead for k in range(4)
    ]

    def cast(p, d):
        query = scene_graph.get_query_output_port().Eval(context)
        ranges = np.full(len(d), np.inf)
        view_of = np.round(np.arctan2(d[:, 1], d[:, 0]) / (np.pi / 2)) % 4
        for k, R_WC in enumerate(views):
            image = query.RenderDepthImage(
                camera, world, RigidTransform(R_WC, p.astype(float))
            )
            rays = np.flatnonzero(view_of == k)
            x, y, z = R_WC.matrix().T @ d[rays].T
            pixel = np.stack([y / z, x / z]) * _PIXELS / 2 + _PIXELS / 2
            row, column = np.clip(pixel.astype(int), 0, _PIXELS - 1)
            ranges[rays] = image.data[row, column, 0] / z
        return ranges

    return cast


PEERS = {
    "cns-drake": cns_drake,
    "Open3D cast_rays": open3d_caster,
    "embreex": embreex_caster,
    "MuJoCo mj_multiRay": mujoco_caster,
    "PyBullet rayTestBatch": pybullet_caster,
    "Drake RenderEngineVtk": drake_depth,
}


def true_ranges(stage: Stage) -> list[np.ndarray]:
    """Returns the distances in float64 to the planes that rays meet."""
    scene = open3d_scene(stage)
    normals = _normals(stage)
    result = []
    for p, d in stage.scans:
        prim = scene.cast_rays(open3d_rays(p, d))["primitive_ids"].numpy()
        hit = prim < len(stage.triangles)
        n = normals[prim[hit]]
        a = stage.vertices[stage.triangles[prim[hit], 0]].astype(float)
        ranges = np.full(len(d), np.inf)
        ranges[hit] = np.einsum("ij,ij->i", n, a - p.astype(float)) / np.einsum(
            "ij,ij->i", n, d[hit].astype(float)
        )
        result.append(ranges)
    return result


def describe_errors(ranges: Sequence[np.ndarray], truth) -> str:
    """Returns in words how far ranges are from the truth."""
    a, b = np.concatenate(ranges).astype(float), np.concatenate(truth)
    # Nobody need look farther; what lies at the limit is nobody's error.
    clear = np.abs(b - REACH) > 0.1
    a, b = a[clear], np.where(b < REACH, b, np.inf)[clear]
    a = np.where(a < REACH, a, np.inf)
    both = np.isfinite(a) & np.isfinite(b)
    error = np.abs(a[both] - b[both])
    false = int((np.isfinite(a) != np.isfinite(b)).sum())
    return (
        f"median {np.median(error):.0e} m, 99.9 % within "
        f"{np.quantile(error, 0.999):.0e} m, {int((error > APART).sum())} "
        f"beyond {APART} m, {false} hit or miss"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drive", nargs="?", default="metropolis_04")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--poses", type=int, default=4)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        stage = make_stage(arguments.drive, arguments.poses, Path(folder))
        rays = stage.directions.shape[0] * stage.directions.shape[1]
        print(
            f"{arguments.drive}: {len(stage.triangles)} triangles, "
            f"{rays} rays, {arguments.rounds} rounds, medians of CPU time"
        )
        casters = {}
        for name, make in PEERS.items():
            try:
                caster = make(stage)
                caster(*next(stage.scans))
                casters[name] = caster
            except ImportError as error:
                print(f"  {name}: not installed ({error.name})")
            except (RuntimeError, ValueError) as error:
                print(f"  {name}: does not run here: {error}")

    results = {}

    def scan(name: str) -> None:
        results[name] = [casters[name](p, d) for p, d in stage.scans]

    times = interleaved(
        {name: lambda name=name: scan(name) for name in casters},
        arguments.rounds,
    )
    truth = true_ranges(stage)
    base = times["Open3D cast_rays"].cpu
    for name, spent in times.items():
        print(
            f"  {name:<22} {1e-6 * rays / spent.cpu:7.3f} Mrays/s, "
            f"{base / spent.cpu:6.3f} of Open3D; error "
            f"{describe_errors(results[name], truth)}"
        )


if __name__ == "__main__":
    main()
