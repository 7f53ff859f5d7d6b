"""The Diagram of a scenario: the only place where systems are connected."""

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import (
    Context,
    Diagram,
    DiagramBuilder,
    LeafSystem,
)
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from cns_drake.motion.vehicle_motion import VehicleMotion
from cns_drake.motion.vehicle_sweep import VehicleSweep
from cns_drake.pictures.meshcat_recorder import MeshcatRecorder
from cns_drake.ray_casting.moving_groups import KnownPoses
from cns_drake.recording.background_writer import BackgroundWriter
from cns_drake.recording.bag_writer import BagWriter
from cns_drake.recording.mcap_recorder import McapRecorder, RecordedSensor
from cns_drake.recording.schedule import START_NS
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scene.world import World
from cns_drake.sensors.camera.camera import add_cameras
from cns_drake.sensors.camera.camera_scene import CameraScene
from cns_drake.sensors.carriers import sensor_pose
from cns_drake.sensors.imu.imu import add_described_imu
from cns_drake.sensors.lidar.adding import add_described_lidar
from cns_drake.sensors.lidar.config import make_pattern
from cns_drake.sensors.odometry.odometry import add_odometry
from cns_drake.simulation.loaded_drive import LoadedDrive, load_drive
from cns_drake.simulation.sensor_recording import connect_by_name
from cns_drake.traffic.traffic_motion import (
    TrafficMotion,
    add_traffic,
    connect_traffic,
)


def make_station(
    drive: Scenario | LoadedDrive,
    *,
    bag: BagWriter | BackgroundWriter | None = None,
    page: MeshcatRecorder | None = None,
    num_threads: int = 1,
    cameras_see_vehicle: bool = False,
) -> Diagram:
    """Makes the Diagram of a scenario.

    Systems for the scene and its motion: `scene_graph` contains the stage and
    the vehicle, `vehicle_motion` prescribes the vehicle's pose, and
    `geometry_pose` passes this pose to the SceneGraph. `traffic` moves all
    other objects, and `frame_poses` collects the poses of all frames.

    Systems that measure: a `Lidar` for each entry of `scenario.lidars`, with
    the same name, and a system `<lidar>_sweep` if the LiDAR has motion
    distortion; an accelerometer and a gyroscope or, if the IMU has a rate or
    errors, the system `imu`; and `odometry`. `mcap_recorder` and
    `meshcat_recorder` record the measurements.

    The exported output ports are `<lidar>_scan`, `specific_force`,
    `angular_velocity`, `odometry` and `geometry_query`. The system `imu` adds
    `imu_samples`, and traffic adds `objects`. Each camera adds
    `<camera>_image`, `<camera>_depth` and `<camera>_label`. Each further sensor
    adds a port of its name.

    Args:
        drive: the scenario to build; or the scenario as `load_drive` returns
            it; the Diagram then takes over the SceneGraph of the loaded world.
        bag: open recording with the scenario's topics, if any.
        page: recorder of a web page of the same world, if any.
        num_threads: number of threads that cast the rays of a LiDAR.
        cameras_see_vehicle: whether cameras see their own vehicle.

    Raises:
        InputError: the scenario's files cannot be used.

    Example:
        from cns_drake import load_scenario, make_station

        diagram = make_station(load_scenario("downtown_01"))
        context = diagram.CreateDefaultContext()
        scan = diagram.GetOutputPort("lidar_scan").Eval(context)
    """
    if isinstance(drive, Scenario):
        drive = load_drive(drive)
    scenario, world, traffic = drive.scenario, drive.world, drive.traffic
    trajectory = drive.trajectory
    plant = world.plant
    base = plant.GetBodyByName("base_link", world.vehicle)

    builder = DiagramBuilder()
    scene_graph = builder.AddNamedSystem("scene_graph", world.scene_graph)
    motion = builder.AddNamedSystem(
        "vehicle_motion",
        VehicleMotion(
            plant, world.vehicle, trajectory, period=scenario.frame_period
        ),
    )
    to_pose = builder.AddNamedSystem(
        "geometry_pose", MultibodyPositionToGeometryPose(plant)
    )
    builder.Connect(motion.GetOutputPort("position"), to_pose.get_input_port())
    builder.Connect(
        to_pose.get_output_port(),
        scene_graph.get_source_pose_port(plant.get_source_id()),
    )

    moving = None
    if traffic is not None:
        moving = add_traffic(
            builder,
            scene_graph,
            traffic,
            seed=scenario.traffic.seed,
            structures=world.structures,
            turn=scenario.frame_period,
        )
    poses = builder.AddNamedSystem("frame_poses", _FramePoses(plant, moving))
    builder.Connect(
        motion.GetOutputPort("body_poses"), poses.GetInputPort("body_poses")
    )
    if moving is not None:
        builder.Connect(
            moving.GetOutputPort("frame_poses"),
            poses.GetInputPort("traffic_poses"),
        )
    # Measurements by name, which is also the name of the exported port.
    measured = {"geometry_query": scene_graph.get_query_output_port()}
    for name, config in scenario.lidars.items():
        moving_bodies = None
        if moving is not None and config.motion_distortion:
            # These frames keep moving during a turn.
            moving_bodies = moving.moving_frames
        lidar = add_described_lidar(
            config,
            builder,
            scene_graph,
            base,
            sensor_pose(config),
            name=name,
            seed=scenario.seed,
            weather=scenario.weather,
            unseen=[
                plant.get_body(k) for k in plant.GetBodyIndices(world.vehicle)
            ],
            moving_bodies=moving_bodies,
            structures=world.structures,
            anchored_frames=world.anchored_frames(),
            num_threads=num_threads,
        )
        builder.Connect(
            poses.get_output_port(), lidar.GetInputPort("frame_poses")
        )
        if config.motion_distortion:
            sweep = builder.AddNamedSystem(
                f"{name}_sweep",
                VehicleSweep(trajectory, lidar.pattern.column_t_ns * 1e-9),
            )
            builder.Connect(
                sweep.GetOutputPort("sweep"), lidar.GetInputPort("sweep")
            )
        if moving is not None:
            connect_traffic(builder, moving, lidar, config.motion_distortion)
        measured[f"{name}_scan"] = lidar.GetOutputPort("scan")
    measured |= add_described_imu(
        scenario.imu,
        builder,
        base,
        trajectory=trajectory,
        motion=motion,
        scan_rate=scenario.fastest_rate,
        seed=scenario.seed,
    )
    odometry = add_odometry(builder, base, motion=motion)
    measured["odometry"] = odometry.GetOutputPort("odometry")
    for name, sensor in scenario.further_sensors.items():
        measured[name] = sensor.add(
            builder,
            scene_graph,
            base,
            motion=motion,
            name=name,
            seed=scenario.seed,
        )

    further = {
        name: RecordedSensor(
            sensor.topic(name), sensor_pose(sensor), sensor.make_message
        )
        for name, sensor in scenario.further_sensors.items()
    }
    if scenario.cameras:
        scene = _copy_for_cameras(
            scene_graph,
            world,
            any(one.depth or one.label for one in scenario.cameras.values()),
            cameras_see_vehicle,
        )
        scene.connect(builder, poses.get_output_port())
        frame = plant.GetBodyFrameIdOrThrow(base.index())
        for name, (port, recorded) in add_cameras(
            builder, scene, frame, scenario.cameras
        ).items():
            measured[name], further[name] = port, recorded

    if moving is not None:
        measured["objects"] = moving.GetOutputPort("objects")
    if page is not None:
        for body in () if moving is None else moving.bodies:
            page.add_moving_object(body.name, body.frames)

    recorders = {"meshcat_recorder": page}
    if bag is not None:
        recorders["mcap_recorder"] = McapRecorder(
            bag,
            X_BSs={n: sensor_pose(one) for n, one in scenario.lidars.items()},
            X_BI=sensor_pose(scenario.imu),
            further=further,
            schedule=drive.recording.schedule,
            layouts=drive.recording.layouts,
            num_rings={
                n: make_pattern(one).num_rings
                for n, one in scenario.lidars.items()
            },
            calibrated=[
                n
                for n, one in scenario.lidars.items()
                if one.returns == "calibrated"
            ],
            imu_variances=scenario.imu.noise(scenario.seed).variances(
                scenario.imu.sample_rate(scenario.fastest_rate)
            ),
            with_objects=moving is not None,
            with_imu_samples="imu_samples" in measured,
            start_ns=START_NS,
        )
    for name, recorder in recorders.items():
        if recorder is not None:
            builder.AddNamedSystem(name, recorder)
            connect_by_name(builder, measured, recorder)
    for name, port in measured.items():
        builder.ExportOutput(port, name)
    diagram = builder.Build()
    diagram.set_name(scenario.name)
    return diagram


def _copy_for_cameras(
    scene_graph: SceneGraph, world: World, classes: bool, with_vehicle: bool
) -> CameraScene:
    """Copies the scene for the cameras on the vehicle."""
    plant = world.plant
    inspector = scene_graph.model_inspector()
    context = plant.CreateDefaultContext()
    world_frame = inspector.world_frame_id()

    def calc_X_WF(frame: FrameId) -> RigidTransform:
        if frame == world_frame:
            return RigidTransform()
        return plant.GetBodyFromFrameId(frame).EvalPoseInWorld(context)

    base = plant.GetBodyByName("base_link", world.vehicle)
    bodies = () if with_vehicle else plant.GetBodyIndices(world.vehicle)
    return CameraScene(
        scene_graph,
        world.structures,
        calc_X_WF,
        anchored=world.anchored_frames() | {world_frame},
        vehicle={plant.GetBodyFrameIdIfExists(body) for body in bodies},
        base=plant.GetBodyFrameIdOrThrow(base.index()),
        classes=classes,
    )


class _FramePoses(LeafSystem):
    """Joins the poses of a plant's bodies and of the traffic's parts.

    With all poses at hand, a LiDAR need not ask the SceneGraph, which would
    compute the poses of all geometry. That would take 5 % of a scan's time, and
    a third with traffic.
    """

    def __init__(self, plant: MultibodyPlant, traffic: TrafficMotion | None):
        """Declares the ports `body_poses` and `traffic_poses`."""
        super().__init__()
        bodies = range(plant.num_bodies())
        frames = [plant.GetBodyFrameIdIfExists(BodyIndex(k)) for k in bodies]
        self._rows = {f: k for k, f in enumerate(frames) if f is not None}
        if traffic is not None:
            limbs = traffic.moving_frames.items()
            self._rows |= {f: len(frames) + k for f, k in limbs}
        self._body_poses = self.DeclareAbstractInputPort(
            "body_poses", AbstractValue.Make([RigidTransform()])
        )
        self._traffic_poses = self.DeclareAbstractInputPort(
            "traffic_poses", Value(object())
        )
        self.DeclareAbstractOutputPort(
            "frame_poses",
            lambda: Value(object()),
            self._calc_frame_poses,
            {self.all_input_ports_ticket()},
        )

    def _calc_frame_poses(
        self, context: Context, output: AbstractValue
    ) -> None:
        X_WFs = np.array(
            [X_WB.GetAsMatrix4() for X_WB in self._body_poses.Eval(context)]
        )
        if self._traffic_poses.HasValue(context):
            X_WLs = self._traffic_poses.Eval(context).X_WFs
            X_WFs = np.concatenate([X_WFs, X_WLs])
        output.set_value(KnownPoses(self._rows, X_WFs))
