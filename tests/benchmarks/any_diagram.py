"""Times of a LiDAR in diagrams of all kinds: what moves, what changes, starts.

    python tests/benchmarks/any_diagram.py

A new process imports and scans; Downtown is scanned by 128 x 1024 beams,
without and with 300 boxes that move between any two scans; then one geometry
changes, of a box and of the city; and a world of 20,000 shapes is built and
scanned; and Drake's own depth image and signed distances cast on 1,000 shapes,
as the LiDAR does. Times are the processor's, on one thread, medians of 15 scans
or more.
"""

from pathlib import Path
import time

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import (
    Box,
    ClippingRange,
    Cylinder,
    DepthRange,
    DepthRenderCamera,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    MakeRenderEngineVtk,
    PerceptionProperties,
    ProximityProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    RenderLabel,
    Role,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo

from cns_drake import Lidar, load_world, make_beam_pattern
from cns_drake.sensors import connect_lidar

WORLD = Path(__file__).parents[2] / "worlds/downtown/stage_04.sdf"
PATTERN = make_beam_pattern("os1-128")
ROUNDS = 15


class Scene:
    """A world, boxes that can be moved, and a LiDAR."""

    def __init__(self, scene_graph, anchored, num_boxes, X_WS):
        self.rng = np.random.default_rng(1)
        self.graph = scene_graph
        self.source = scene_graph.RegisterSource("boxes")
        self.frames = []
        self.boxes = []
        for k in range(num_boxes):
            frame = scene_graph.RegisterFrame(
                self.source, GeometryFrame(f"box_{k}")
            )
            made = GeometryInstance(RigidTransform(), Box(2, 1, 1.5), "box")
            made.set_perception_properties(PerceptionProperties())
            self.boxes.append(
                scene_graph.RegisterGeometry(self.source, frame, made)
            )
            self.frames.append(frame)
        builder = DiagramBuilder()
        builder.AddNamedSystem("scene_graph", scene_graph)
        self.lidar = builder.AddNamedSystem(
            "lidar",
            Lidar(
                scene_graph.world_frame_id(),
                X_WS,
                PATTERN,
                anchored_frames=anchored,
            ),
        )
        connect_lidar(builder, scene_graph, self.lidar)
        self.context = builder.Build().CreateDefaultContext()
        self.own = self.lidar.GetMyContextFromRoot(self.context)
        self.of_graph = scene_graph.GetMyMutableContextFromRoot(self.context)

    def set_poses(self):
        poses = FramePoseVector()
        for frame in self.frames:
            angle = RollPitchYaw(0.0, 0.0, self.rng.uniform(-3, 3))
            place = [*self.rng.uniform(-60, 60, 2), 0.75]
            poses.set_value(frame, RigidTransform(angle, place))
        self.graph.get_source_pose_port(self.source).FixValue(
            self.of_graph, AbstractValue.Make(poses)
        )

    def time_scan(self, change):
        change()
        # The SceneGraph's own share, which it does when it is first asked.
        query_object = self.graph.get_query_output_port().Eval(self.of_graph)
        for frame in self.frames[:1]:
            query_object.GetPoseInWorld(frame)
        start = time.process_time()
        scan = self.lidar.GetOutputPort("scan").Eval(self.own)
        return 1e3 * (time.process_time() - start), len(scan)

    def median(self, change):
        return np.median([self.time_scan(change)[0] for _ in range(ROUNDS)])


def in_downtown(num_boxes):
    world = load_world(WORLD)
    plant = world.plant
    scene = Scene(
        world.scene_graph,
        world.anchored_frames(),
        num_boxes,
        RigidTransform([0.0, -8.0, 1.8]),
    )
    poses = FramePoseVector()
    context = plant.CreateDefaultContext()
    inspector = world.scene_graph.model_inspector()
    for frame_id in inspector.FramesForSource(plant.get_source_id()):
        body = plant.GetBodyFromFrameId(frame_id)
        poses.set_value(frame_id, plant.EvalBodyPoseInWorld(context, body))
    scene.graph.get_source_pose_port(plant.get_source_id()).FixValue(
        scene.of_graph, AbstractValue.Make(poses)
    )
    scene.set_poses()
    return scene, plant.get_source_id(), poses


def new_process():
    """Times imports, the first scan of the process, and the next one."""
    imported = time.process_time()
    scene = Scene(shapes(1000), (), 1, RigidTransform([0.0, 0.0, 1.8]))
    first, following = (scene.time_scan(scene.set_poses)[0] for _ in range(2))
    print(
        f"in a new process: imports {imported:.2f} s, first scan "
        f"{1e-3 * first:.2f} s, next one {following:.0f} ms"
    )


def main():
    new_process()
    still, city, poses = in_downtown(0)
    moving, _, _ = in_downtown(300)
    print(f"first scan of Downtown: {still.time_scan(lambda: None)[0]:.0f} ms")
    moving.time_scan(lambda: None)

    def anew():
        still.graph.get_source_pose_port(city).FixValue(
            still.of_graph, AbstractValue.Make(poses)
        )

    pairs = [
        (still.time_scan(anew)[0], moving.time_scan(moving.set_poses)[0])
        for _ in range(4 * ROUNDS)
    ]
    without, with_boxes = np.median(pairs, axis=0)
    print(
        f"a scan: {without:.1f} ms, with 300 moving boxes {with_boxes:.1f} ms:"
        f" {100 * (with_boxes / without - 1):+.0f} %"
    )
    sizes = iter(np.linspace(1.0, 2.0, 200))

    def change_box():
        moving.graph.ChangeShape(
            moving.of_graph,
            moving.source,
            moving.boxes[0],
            Box(2, 1, next(sizes)),
        )

    inspector = still.graph.model_inspector()
    thing = inspector.GetAllGeometryIds(Role.kPerception)[-1]

    def change_city():
        still.graph.ChangeShape(
            still.of_graph, city, thing, Box(2, 1, next(sizes))
        )

    print(f"after a box changed: {moving.median(change_box):.0f} ms")
    print(f"after the city changed: {still.median(change_city):.0f} ms")
    many()
    beside_drake()


def shapes(count):
    """Returns a SceneGraph of boxes, spheres and cylinders for all roles."""
    rng = np.random.default_rng(2)
    graph = SceneGraph()
    graph.AddRenderer("vtk", MakeRenderEngineVtk(RenderEngineVtkParams()))
    source = graph.RegisterSource("shapes")
    for k in range(count):
        shape = (Box(1, 2, 1), Sphere(0.5), Cylinder(0.4, 2.0))[k % 3]
        place = RigidTransform([*rng.uniform(-200, 200, 2), 1.0])
        made = GeometryInstance(place, shape, f"shape_{k}")
        properties = PerceptionProperties()
        properties.AddProperty("label", "id", RenderLabel(1))
        made.set_perception_properties(properties)
        if count < 10_000:
            made.set_proximity_properties(ProximityProperties())
        graph.RegisterAnchoredGeometry(source, made)
    return graph


def many():
    start = time.process_time()
    graph = shapes(20_000)
    registered = time.process_time()
    scene = Scene(graph, (), 0, RigidTransform([0.0, 0.0, 1.8]))
    scene.time_scan(lambda: None)
    print(
        f"20,000 shapes: registered in {registered - start:.1f} s, scanned "
        f"{time.process_time() - registered:.1f} s later"
    )


def beside_drake():
    """Times Drake's own queries on a scene of 1,000 shapes."""
    graph = shapes(1000)
    X_WS = RigidTransform([0.0, 0.0, 1.8])
    start = time.process_time()
    scene = Scene(graph, (), 1, X_WS)
    scene.time_scan(scene.set_poses)
    print(f"first scan: {time.process_time() - start:.2f} s after the scene")
    query = graph.get_query_output_port().Eval(scene.of_graph)
    world = graph.world_frame_id()
    camera = DepthRenderCamera(
        RenderCameraCore(
            "vtk",
            CameraInfo(512, 512, np.pi / 2),
            ClippingRange(0.1, 200.0),
            RigidTransform(),
        ),
        DepthRange(0.2, 120.0),
    )
    X_WC = X_WS @ RigidTransform(
        RollPitchYaw(-np.pi / 2, 0.0, -np.pi / 2), np.zeros(3)
    )
    d_Ws = PATTERN.d_Sset[:: len(PATTERN.d_Sset) // 20]

    def render():
        query.RenderDepthImage(camera, world, X_WC)

    def step_along_rays():
        """Casts by sphere tracing, down to a millimetre."""
        for d_W in d_Ws:
            way = 0.0
            step = 1.0
            while step > 1e-3 and way < 120.0:
                p_WQ = X_WS.translation() + way * d_W
                near = query.ComputeSignedDistanceToPoint(p_WQ)
                step = min(one.distance for one in near)
                way += step

    scan = scene.median(scene.set_poses) * 1e-3
    for name, rays, seconds in (
        ("this LiDAR", len(PATTERN.d_Sset), scan),
        ("RenderDepthImage of VTK", 512 * 512, timed(render)),
        ("signed distances", len(d_Ws), timed(step_along_rays)),
    ):
        print(f"{name}: {1e-6 * rays / seconds:.6f} million rays a second")


def timed(act):
    """Returns the median CPU time of an action [s]."""
    act()
    times = []
    for _ in range(3):
        start = time.process_time()
        act()
        times.append(time.process_time() - start)
    return np.median(times)


if __name__ == "__main__":
    main()
