"""The Diagram of a scenario: the only place where systems are connected."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import (
    Context,
    Diagram,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
)
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from cns_drake.motion import VehicleMotion, VehicleSweep
from cns_drake.ray_casting import KnownPoses
from cns_drake.recording import (
    START_NS,
    BackgroundWriter,
    BagWriter,
    McapRecorder,
    RecordedSensor,
)
from cns_drake.scenarios import DrivePlan, Scenario
from cns_drake.sensors import (
    CameraScene,
    add_cameras,
    add_described_imu,
    add_lidar,
    add_odometry,
    make_lidar_model,
    make_pattern,
    sensor_pose,
)
from cns_drake.simulation.loaded_drive import LoadedDrive, load_drive
from cns_drake.simulation.sensor_recording import connect_by_name
from cns_drake.traffic import TrafficMotion, add_traffic, connect_traffic

if TYPE_CHECKING:
    from cns_drake.pictures import MeshcatRecorder


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
        drive: the scenario to build, or the result of `load_drive` for this
            scenario. In the second case, the Diagram takes over the SceneGraph
            of the loaded world.
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
        drive = load_drive(DrivePlan(drive))
    scenario, world = drive.scenario, drive.world
    builder = DiagramBuilder()
    scene_graph = builder.AddNamedSystem("scene_graph", world.scene_graph)
    motion = _add_vehicle_motion(builder, drive)
    traffic = _add_traffic(builder, drive)
    poses = _add_frame_poses(builder, drive, motion, traffic)
    # Measurements by name, which is also the name of the exported port.
    measured = {"geometry_query": scene_graph.get_query_output_port()}
    measured |= _add_lidars(builder, drive, poses, traffic, num_threads)
    measured |= add_described_imu(
        scenario.imu,
        builder,
        drive.base_link,
        trajectory=drive.trajectory,
        motion=motion,
        scan_rate=scenario.fastest_rate,
        seed=scenario.seed,
    )
    odometry = add_odometry(builder, drive.base_link, motion=motion)
    measured["odometry"] = odometry.GetOutputPort("odometry")
    further = _add_further_sensors(builder, drive, motion)
    further |= _add_cameras(builder, drive, poses, cameras_see_vehicle)
    measured |= {name: port for name, (port, _) in further.items()}
    if traffic is not None:
        measured["objects"] = traffic.GetOutputPort("objects")
    if page is not None:
        for body in () if traffic is None else traffic.bodies:
            page.add_moving_object(body.name, body.frames)
        builder.AddNamedSystem("meshcat_recorder", page)
        connect_by_name(builder, measured, page)
    if bag is not None:
        recorder = _make_recorder(
            drive,
            bag,
            {name: recorded for name, (_, recorded) in further.items()},
            with_imu_samples="imu_samples" in measured,
        )
        builder.AddNamedSystem("mcap_recorder", recorder)
        connect_by_name(builder, measured, recorder)
    for name, port in measured.items():
        builder.ExportOutput(port, name)
    diagram = builder.Build()
    diagram.set_name(scenario.name)
    return diagram


def _add_vehicle_motion(
    builder: DiagramBuilder, drive: LoadedDrive
) -> VehicleMotion:
    """Adds the motion of the vehicle, and passes it to the SceneGraph."""
    world = drive.world
    plant = world.plant
    motion = builder.AddNamedSystem(
        "vehicle_motion",
        VehicleMotion(
            plant,
            world.vehicle,
            drive.trajectory,
            period=drive.scenario.frame_period,
        ),
    )
    to_pose = builder.AddNamedSystem(
        "geometry_pose", MultibodyPositionToGeometryPose(plant)
    )
    builder.Connect(motion.GetOutputPort("position"), to_pose.get_input_port())
    builder.Connect(
        to_pose.get_output_port(),
        world.scene_graph.get_source_pose_port(plant.get_source_id()),
    )
    return motion


def _add_traffic(
    builder: DiagramBuilder, drive: LoadedDrive
) -> TrafficMotion | None:
    if drive.traffic is None:
        return None
    return add_traffic(
        builder,
        drive.world.scene_graph,
        drive.traffic,
        seed=drive.scenario.traffic.seed,
        structures=drive.world.structures,
        turn=drive.scenario.frame_period,
    )


def _add_frame_poses(
    builder: DiagramBuilder,
    drive: LoadedDrive,
    motion: VehicleMotion,
    traffic: TrafficMotion | None,
) -> OutputPort:
    """Adds the system that joins all poses; returns the port with the poses."""
    poses = builder.AddNamedSystem(
        "frame_poses", _FramePoses(drive.world.plant, traffic)
    )
    builder.Connect(
        motion.GetOutputPort("body_poses"), poses.GetInputPort("body_poses")
    )
    if traffic is not None:
        builder.Connect(
            traffic.GetOutputPort("frame_poses"),
            poses.GetInputPort("traffic_poses"),
        )
    return poses.get_output_port()


def _add_lidars(
    builder: DiagramBuilder,
    drive: LoadedDrive,
    poses: OutputPort,
    traffic: TrafficMotion | None,
    num_threads: int,
) -> dict[str, OutputPort]:
    """Adds the LiDARs of a drive; returns the ports with their scans.

    Returns:
        `<lidar>_scan` -> the port.
    """
    scenario, world = drive.scenario, drive.world
    plant = world.plant
    ports = {}
    for name, config in scenario.lidars.items():
        moving_bodies = None
        if traffic is not None and config.motion_distortion:
            # These frames keep moving during a revolution.
            moving_bodies = traffic.moving_frames
        model = make_lidar_model(config, name, scenario.seed, scenario.weather)
        lidar = add_lidar(
            builder,
            world.scene_graph,
            drive.base_link,
            drive.X_BSs[name],
            name=name,
            **model._asdict(),
            unseen=[
                plant.get_body(k) for k in plant.GetBodyIndices(world.vehicle)
            ],
            moving_bodies=moving_bodies,
            structures=world.structures,
            anchored_frames=world.anchored_frames(),
            num_threads=num_threads,
        )
        builder.Connect(poses, lidar.GetInputPort("frame_poses"))
        if config.motion_distortion:
            sweep = builder.AddNamedSystem(
                f"{name}_sweep",
                VehicleSweep(
                    drive.trajectory, lidar.pattern.column_t_ns * 1e-9
                ),
            )
            builder.Connect(
                sweep.GetOutputPort("sweep"), lidar.GetInputPort("sweep")
            )
        if traffic is not None:
            connect_traffic(builder, traffic, lidar, config.motion_distortion)
        ports[f"{name}_scan"] = lidar.GetOutputPort("scan")
    return ports


def _add_further_sensors(
    builder: DiagramBuilder, drive: LoadedDrive, motion: VehicleMotion
) -> dict[str, tuple[OutputPort, RecordedSensor]]:
    """Adds the sensors of kinds that a user has defined.

    Returns:
        Name of a sensor -> its port, and how the port is recorded.
    """
    scenario = drive.scenario
    return {
        name: (
            sensor.add(
                builder,
                drive.world.scene_graph,
                drive.base_link,
                motion=motion,
                name=name,
                seed=scenario.seed,
            ),
            RecordedSensor(
                sensor.topic(name), sensor_pose(sensor), sensor.make_message
            ),
        )
        for name, sensor in scenario.further_sensors.items()
    }


def _add_cameras(
    builder: DiagramBuilder,
    drive: LoadedDrive,
    poses: OutputPort,
    see_vehicle: bool,
) -> dict[str, tuple[OutputPort, RecordedSensor]]:
    """Adds the cameras of a drive, and the scene that they see.

    Returns:
        Name of a stream of images -> its port, and how the port is recorded.
    """
    cameras = drive.scenario.cameras
    if not cameras:
        return {}
    scene = _copy_for_cameras(
        drive,
        classes=any(
            camera.depth or camera.label for camera in cameras.values()
        ),
        with_vehicle=see_vehicle,
    )
    scene.connect(builder, poses)
    plant = drive.world.plant
    frame = plant.GetBodyFrameIdOrThrow(drive.base_link.index())
    return add_cameras(builder, scene, frame, cameras)


def _copy_for_cameras(
    drive: LoadedDrive, *, classes: bool, with_vehicle: bool
) -> CameraScene:
    world = drive.world
    plant = world.plant
    context = plant.CreateDefaultContext()
    world_frame = world.scene_graph.model_inspector().world_frame_id()

    def calc_X_WF(frame: FrameId) -> RigidTransform:
        if frame == world_frame:
            return RigidTransform()
        return plant.GetBodyFromFrameId(frame).EvalPoseInWorld(context)

    bodies = () if with_vehicle else plant.GetBodyIndices(world.vehicle)
    return CameraScene(
        world.scene_graph,
        world.structures,
        calc_X_WF,
        anchored=world.anchored_frames() | {world_frame},
        vehicle={plant.GetBodyFrameIdIfExists(body) for body in bodies},
        base=plant.GetBodyFrameIdOrThrow(drive.base_link.index()),
        classes=classes,
    )


def _make_recorder(
    drive: LoadedDrive,
    bag: BagWriter | BackgroundWriter,
    further: Mapping[str, RecordedSensor],
    *,
    with_imu_samples: bool,
) -> McapRecorder:
    """Makes the recorder of a drive's measurements."""
    scenario = drive.scenario
    lidars = scenario.lidars
    return McapRecorder(
        bag,
        X_BSs=drive.X_BSs,
        X_BI=sensor_pose(scenario.imu),
        further=further,
        schedule=drive.recording.schedule,
        layouts=drive.recording.layouts,
        num_rings={
            n: make_pattern(lidar).num_rings for n, lidar in lidars.items()
        },
        calibrated={
            n: lidar.echoes
            for n, lidar in lidars.items()
            if lidar.returns == "calibrated"
        },
        imu_variances=scenario.imu.noise(scenario.seed).variances(
            scenario.imu.sample_rate(scenario.fastest_rate)
        ),
        with_objects=drive.traffic is not None,
        with_imu_samples=with_imu_samples,
        start_ns=START_NS,
    )


class _FramePoses(LeafSystem):
    """Joins the poses of a plant's bodies and of the traffic's parts.

    .. pydrake_system::

        name: FramePoses
        input_ports:
        - body_poses
        - traffic_poses (with traffic)
        output_ports:
        - frame_poses

    `body_poses` is abstract: the poses X_WB of the plant's bodies, as a list.
    `traffic_poses` and `frame_poses` are abstract, of type `KnownPoses`.

    A LiDAR that has all poses need not ask the SceneGraph, which would compute
    the poses of all geometry. This computation would take 5 % of a scan's time
    without traffic, and a third of a scan's time with traffic.
    """

    def __init__(self, plant: MultibodyPlant, traffic: TrafficMotion | None):
        """Declares the ports.

        Args:
            plant: the plant whose bodies have the poses on `body_poses`.
            traffic: the traffic whose parts have the poses on `traffic_poses`;
                None without traffic.
        """
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
