"""What the benchmarks of ray casting share: stages, poses, timing."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import time

import numpy as np
import open3d
from pydrake.geometry import FrameId, GeometryId
from pydrake.math import RigidTransform, RollPitchYaw

from cns_drake.ray_casting import RayCastingScene
from cns_drake.scenarios import load_scenario, plan_drive
from cns_drake.scene import (
    PerceptionGeometry,
    TriangleSurface,
    load_world,
    merge_triangles,
    read_perception_geometry,
    tessellate,
)


def read_stage(drive: str) -> list[PerceptionGeometry]:
    """Returns the geometry of a drive's stage."""
    world = load_world(load_scenario(drive).world_file)
    return read_perception_geometry(world.scene_graph.model_inspector())


def sensor_poses(drive: str, count: int) -> list[RigidTransform]:
    """Returns poses X_WS of the LiDAR, evenly spread over a drive."""
    trajectory = plan_drive(load_scenario(drive))
    times = np.linspace(0.0, trajectory.duration, count)
    X_BS = RigidTransform([0.0, 0.0, 1.6])
    return [trajectory.pose(t) @ X_BS for t in times]


def count_triangles(geometries: Sequence[PerceptionGeometry]) -> int:
    """Returns how many triangles there are, without curved shapes."""
    return sum(
        len(geometry.surface.triangles)
        for geometry in geometries
        if isinstance(geometry.surface, TriangleSurface)
    )


def still(frame_id: FrameId) -> RigidTransform:
    """The pose of every frame of a stage in the world."""
    return RigidTransform()


class Open3dStage:
    """A stage in Open3D: what stands in the world, as one scene."""

    def __init__(self, geometries: Sequence[PerceptionGeometry]):
        """Builds the scene."""
        # Ranges in float32 are most precise near the middle.
        places = np.array([one.X_FG.translation() for one in geometries])
        self._p_WO = (places.min(axis=0) + places.max(axis=0)) / 2.0
        X_OW = RigidTransform(-self._p_WO)
        surface, _ = merge_triangles(
            [
                (k, X_OW @ one.X_FG, tessellate(one.surface, 128))
                for k, one in enumerate(geometries)
            ]
        )
        self.scene = open3d.t.geometry.RaycastingScene(nthreads=1)
        self.scene.add_triangles(
            open3d.core.Tensor(surface.p_GVset.astype(np.float32)),
            open3d.core.Tensor(surface.triangles.astype(np.uint32)),
        )

    def rays(self, X_WS: RigidTransform, d_Sset) -> open3d.core.Tensor:
        """Returns the rays of (N, 3) beams from a sensor's pose."""
        rays = np.empty((len(d_Sset), 6), np.float32)
        rays[:, :3] = X_WS.translation() - self._p_WO
        rays[:, 3:] = d_Sset @ X_WS.rotation().matrix().T
        return open3d.core.Tensor.from_numpy(rays)

    def cast(self, rays: open3d.core.Tensor) -> np.ndarray:
        """Returns their ranges, inf for a miss; on one thread."""
        return self.scene.cast_rays(rays, nthreads=1)["t_hit"].numpy()


class MovingCars:
    """A stage with cars that are somewhere else at every step.

    A car is a rounded body of 1280 triangles, 6 m to 40 m ahead of one of
    the sensor's poses.
    """

    def __init__(
        self,
        geometries: Sequence[PerceptionGeometry],
        poses: Sequence[RigidTransform],
        count: int,
    ):
        """Builds the scene with so many cars."""
        body = _car_body()
        frames = [FrameId.get_new_id() for _ in range(count)]
        cars = [
            PerceptionGeometry(
                GeometryId.get_new_id(), "car", f, RigidTransform(), body, None
            )
            for f in frames
        ]
        rng = np.random.default_rng(0)
        self._steps = [
            {
                frame: _ahead(poses[(step + k) % len(poses)], rng)
                for k, frame in enumerate(frames)
            }
            for step in range(len(poses))
        ]
        self._step = 0
        stands = {geometry.frame_id for geometry in geometries}
        self.scene = RayCastingScene([*geometries, *cars], stands, self._pose)

    def move(self, step: int) -> None:
        """Moves every car."""
        self._step = step
        self.scene.set_frame_poses(self._pose)

    def _pose(self, frame_id: FrameId) -> RigidTransform:
        return self._steps[self._step].get(frame_id, RigidTransform())


def _ahead(X_WS: RigidTransform, rng: np.random.Generator) -> RigidTransform:
    """Returns a pose of a car 6 m to 40 m ahead of a sensor's pose."""
    yaw = RollPitchYaw(X_WS.rotation()).yaw_angle()
    forward = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    ahead = rng.uniform(6.0, 40.0) * forward - [0.0, 0.0, 0.9]
    return RigidTransform(RollPitchYaw(0, 0, yaw), X_WS.translation() + ahead)


def _car_body() -> TriangleSurface:
    mesh = open3d.geometry.TriangleMesh.create_icosahedron()
    mesh = mesh.subdivide_loop(3)
    return TriangleSurface(
        np.asarray(mesh.vertices) * [2.2, 0.9, 0.7],
        np.asarray(mesh.triangles),
    )


@dataclass(frozen=True)
class Spent:
    """Median times of a variant [s]: on the clock, and of all threads."""

    wall: float
    cpu: float


def interleaved(
    variants: dict[str, Callable[[], None]], rounds: int
) -> dict[str, Spent]:
    """Returns the median times of each variant.

    One round runs every variant once; each round starts with another one, so
    that whatever else the machine does meets all of them alike.
    """
    names = list(variants)
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in names}
    for variant in variants.values():
        variant()
    for k in range(rounds):
        for name in names[k % len(names) :] + names[: k % len(names)]:
            wall, cpu = time.perf_counter(), time.process_time()
            variants[name]()
            times[name].append(
                (time.perf_counter() - wall, time.process_time() - cpu)
            )
    return {
        name: Spent(*np.median(values, axis=0).tolist())
        for name, values in times.items()
    }
