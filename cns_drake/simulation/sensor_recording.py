"""Recording the sensors of any diagram."""

from collections.abc import Collection, Iterable, Mapping
import math
from pathlib import Path
from types import NoneType

from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder, OutputPort, System
from pydrake.systems.sensors import Gyroscope, RgbdSensor

from cns_drake.recording import (
    ENCODINGS,
    END_NS,
    IMU_TOPIC,
    ODOMETRY_TOPIC,
    TF_TOPIC,
    BagWriter,
    McapRecorder,
    RecordedCamera,
    Schedule,
    Topic,
    camera_topic,
    depth_info_topic,
    make_calibration,
    make_schedule,
    points_topic,
    recording_topics,
)
from cns_drake.sensors import (
    HIGHEST_RATE,
    Imu,
    Lidar,
    OdometrySensor,
    check_in_diagram,
    check_unused_names,
)
from evaluation.base import check_type, of_type
from evaluation.drives import check_sensor_names


def add_mcap_recorder(
    builder: DiagramBuilder,
    folder: Path | str,
    *,
    period: float | None = None,
    rates: Mapping[str, float] | None = None,
    lidars: Collection[Lidar] = (),
    cameras: Mapping[str, RgbdSensor] | None = None,
    imu: Imu | None = None,
    odometry: OdometrySensor | None = None,
    start_ns: int = 0,
    overwrite: bool = False,
    name: str = "mcap_recorder",
) -> BagWriter:
    """Adds a recorder of a diagram's sensors, as a rosbag2 folder.

    The topics are `/<name of the system>/points` for every LiDAR;
    `/<name>/color`, `depth`, `label` and `camera_info` for every camera, and
    `/<name>/depth/camera_info` if depth images have other intrinsics or another
    pose than colour images (the frame of depth images is then `<name>_depth`);
    `/imu/data` for an IMU; and `/odometry` for odometry. The poses of sensors
    on the same body as the odometry are in `/tf_static`; the poses of all other
    sensors are in `/tf`.

    A LiDAR that was added with a rate is recorded as often as it takes scans,
    together with the odometry of these times. A sensor with an entry in `rates`
    is recorded at this rate. An IMU that was added with a rate is recorded at
    that rate. All other sensors are recorded once per `period`. Without
    `period`, each LiDAR is recorded once per revolution, and all other sensors
    as often as the first LiDAR.

    Args:
        builder: builder of a diagram with the sensors.
        folder: the rosbag2 folder to write.
        period: time between two messages of a sensor without a rate [s]. You
            can leave out this argument if there is a LiDAR.
        rates: name of a LiDAR or a camera, `imu` or `odometry` -> messages
            per second, at most 1000.
        lidars: LiDARs to record; each needs a different name.
        cameras: name -> camera to record.
        imu: IMU to record, if any.
        odometry: odometry to record, if any.
        start_ns: time stamp of the simulation's time zero [ns].
        overwrite: whether an existing recording may be replaced.
        name: name of the system.

    Returns:
        The recording: a context manager. Simulate the diagram inside its
        context.

    Raises:
        InputError: the folder contains a finished recording or other files.
        RuntimeError: a sensor is in another diagram.
        TypeError: an argument is of another type.
        ValueError: `rates` names an unknown sensor, neither a period nor a
            LiDAR is given, `period` or `start_ns` is out of range, a LiDAR is
            causal (its scan covers the revolution before its time stamp), a
            LiDAR with a rate is to be recorded at another rate, or has a delay
            and is not on the body of the odometry, or names of sensors are not
            unique or cannot be parts of ROS 2 topics.

    Example:
        from cns_drake import add_mcap_recorder

        bag = add_mcap_recorder(builder, "drive", lidars=[lidar], period=0.1)
        simulator = Simulator(builder.Build())
        with bag:
            simulator.AdvanceTo(10.0)
    """
    cameras = cameras or {}
    folder = Path(of_type(folder, str, "folder"))
    overwrite = of_type(overwrite, bool, "overwrite")
    start_ns = of_type(start_ns, int, "start_ns")
    if not 0 <= start_ns < END_NS:
        raise ValueError(
            f"start_ns: {start_ns!r} is not an integer from 0 on, below"
            f" {END_NS}"
        )
    check_unused_names(builder, name)
    _check_sensors(builder, lidars, cameras, imu, odometry)
    check_type("rates", rates, Mapping, NoneType)
    periods = _message_periods(period, rates or {}, lidars, cameras, imu)
    discrete = {
        lidar.get_name(): lidar.samples for lidar in lidars if lidar.samples
    }
    X_BSs = {
        lidar.get_name(): _pose_at_odometry(lidar, odometry) for lidar in lidars
    }
    for key, samples in discrete.items():
        if X_BSs[key] is None and samples.delay:
            # Its pose comes after later poses, on a topic in order of time.
            raise ValueError(
                f"lidars: '{key}' has an output_delay; its pose is recorded "
                "only with the odometry of its body"
            )
    recorded = {
        key: _recorded_camera(camera) for key, camera in cameras.items()
    }
    X_BI = None
    if imu is not None and odometry is not None:
        X_BI = odometry.place_of(
            imu.gyroscope.body_index(), imu.gyroscope.pose()
        )
    variances = 0.0, 0.0
    if imu is not None and imu.noise is not None and imu.rate is not None:
        variances = imu.noise.variances(imu.rate)
    fixed = {key: X_BS for key, X_BS in X_BSs.items() if X_BS is not None}
    topics = recording_topics(
        X_BSs,
        camera_names=cameras,
        with_imu=imu is not None,
        with_odometry=odometry is not None,
        depth_camera_names=[key for key, c in recorded.items() if c.depth],
    )
    bag = BagWriter(
        folder,
        topics,
        start_ns=start_ns,
        attachments={"calibration.json": make_calibration(fixed, X_BI)},
        scenario={},
        overwrite=overwrite,
    )
    recorder = builder.AddNamedSystem(
        name,
        McapRecorder(
            bag,
            X_BSs=X_BSs,
            X_BI=X_BI,
            cameras=recorded,
            schedule=_make_schedule(periods, topics, discrete),
            discrete=discrete,
            imu_variances=variances,
            start_ns=start_ns,
            has_steps=True,
        ),
    )
    connect_by_name(
        builder, _recorded_ports(lidars, cameras, imu, odometry), recorder
    )
    return bag


def _check_sensors(
    builder: DiagramBuilder,
    lidars: Collection[Lidar],
    cameras: Mapping[str, RgbdSensor],
    imu: Imu | None,
    odometry: OdometrySensor | None,
) -> None:
    """Checks sensors before they are recorded.

    Raises:
        RuntimeError: a sensor is in another diagram.
        TypeError: a sensor is of another type.
        ValueError: a LiDAR is causal, or names are not unique or cannot be
            parts of ROS 2 topics.
    """
    check_type("lidars", lidars, Collection)
    check_type("cameras", cameras, Mapping)
    check_type("imu", imu, Imu, NoneType)
    systems = [
        *(("lidars", lidar, Lidar) for lidar in lidars),
        *((f"cameras: {n}", one, RgbdSensor) for n, one in cameras.items()),
    ]
    if odometry is not None:
        systems.append(("odometry", odometry, OdometrySensor))
    if imu is not None:
        systems.append(("imu", imu.gyroscope, Gyroscope))
    for argument, system, kind in systems:
        check_type(argument, system, kind)
        check_in_diagram(builder, system, argument)
    for lidar in lidars:
        if lidar.causal:
            raise ValueError(
                f"lidars: '{lidar.get_name()}' is causal: its scan begins a "
                "revolution before the time with which a recording stamps it"
            )
    check_sensor_names((*(lidar.get_name() for lidar in lidars), *cameras))


def _recorded_ports(
    lidars: Iterable[Lidar],
    cameras: Mapping[str, RgbdSensor],
    imu: Imu | None,
    odometry: OdometrySensor | None,
) -> dict[str, OutputPort]:
    """Returns the ports to record, by the names of the recorder's inputs."""
    ports: dict[str, OutputPort] = {}
    for lidar in lidars:
        ports[f"{lidar.get_name()}_scan"] = lidar.GetOutputPort("scan")
        ports[f"{lidar.get_name()}_pose"] = lidar.GetOutputPort("X_WS")
        ports[f"{lidar.get_name()}_time"] = lidar.GetOutputPort("scan_time")
    for key, camera in cameras.items():
        ports[f"{key}_color"] = camera.color_image_output_port()
        ports[f"{key}_depth"] = camera.depth_image_32F_output_port()
        ports[f"{key}_label"] = camera.label_image_output_port()
        ports[f"{key}_pose"] = camera.body_pose_in_world_output_port()
    if odometry is not None:
        ports["odometry"] = odometry.GetOutputPort("odometry")
    if imu is not None:
        ports |= imu.ports()
    return ports


def connect_by_name(
    builder: DiagramBuilder, ports: Mapping[str, OutputPort], recorder: System
) -> None:
    """Connects output ports to the inputs of a recorder by their names.

    Args:
        builder: builder of a diagram with the recorder.
        ports: name of a measured quantity -> its output port.
        recorder: the recorder. An input stays unconnected if no port has its
            name.
    """
    for key, port in ports.items():
        if recorder.HasInputPort(key):
            builder.Connect(port, recorder.GetInputPort(key))


def _message_periods(
    period: float | None,
    rates: Mapping[str, float],
    lidars: Collection[Lidar],
    cameras: Mapping[str, RgbdSensor],
    imu: Imu | None,
) -> dict[str, float]:
    """Returns sensor name -> time between its messages [s]."""
    own = {
        lidar.get_name(): lidar.samples.period
        for lidar in lidars
        if lidar.samples
    }
    revolutions = {
        lidar.get_name(): own.get(lidar.get_name(), lidar.pattern.period)
        for lidar in lidars
    }
    if period is None and not revolutions:
        raise ValueError("period: a recording without a LiDAR needs one")
    of_type(period, float | None, "period")
    if period is not None and not 1.0 / HIGHEST_RATE <= period < math.inf:
        raise ValueError(
            f"period: {period!r} is not a number of seconds from"
            f" {1.0 / HIGHEST_RATE:g} on"
        )
    usual = next(iter(revolutions.values())) if period is None else period
    periods = dict.fromkeys((*revolutions, *cameras, "imu", "odometry"), usual)
    if period is None:
        periods |= revolutions
    periods |= own
    if imu is not None and imu.rate is not None:
        periods["imu"] = 1.0 / imu.rate
    for name, rate in rates.items():
        if name not in periods:
            raise ValueError(
                f"rates: no sensor '{name}'; there are: {', '.join(periods)}"
            )
        if not 0.0 < of_type(rate, float, f"rates: {name}") <= HIGHEST_RATE:
            raise ValueError(
                f"rates: {name}: {rate!r} is not a positive number of messages "
                f"a second, at most {HIGHEST_RATE}"
            )
        if 1.0 / rate != own.get(name, 1.0 / rate):
            raise ValueError(
                f"rates: {name}: the LiDAR takes {1.0 / own[name]:g} scans per "
                "second, and is recorded as often; leave it out"
            )
        periods[name] = 1.0 / rate
    return periods


def _moving_period(periods: Mapping[str, float]) -> float:
    """Returns the time between two messages of `/tf` [s].

    `/tf` has all moving frames, at the highest rate of any of them.
    """
    return min(period for name, period in periods.items() if name != "imu")


def _make_schedule(
    periods: Mapping[str, float],
    topics: Collection[Topic],
    discrete: Collection[str],
) -> Schedule:
    """Returns the schedule of the topics of sensors with periods [s].

    Args:
        periods: name of a sensor -> time between its messages [s].
        topics: topics of the recording.
        discrete: names of the discrete LiDARs, which have events of their own.
    """
    own = set(map(points_topic, discrete))
    sensor_of = {IMU_TOPIC: "imu", ODOMETRY_TOPIC: "odometry"}
    for name in periods:
        sensor_of[points_topic(name)] = name
        for kind in (*ENCODINGS, "camera_info"):
            sensor_of[camera_topic(name, kind)] = name
        sensor_of[depth_info_topic(name)] = name
    moving = _moving_period(periods)
    return make_schedule(
        {
            topic.name: moving
            if topic == TF_TOPIC
            else periods[sensor_of[topic]]
            for topic in topics
            if not topic.latched and topic not in own
        }
    )


def _pose_at_odometry(
    lidar: Lidar, odometry: OdometrySensor | None
) -> RigidTransform | None:
    """Returns X_BS if the LiDAR is on the odometry's body, or else None."""
    if odometry is None or odometry.frame_id != lidar.parent_frame_id:
        return None
    return odometry.X_PB.inverse() @ lidar.X_PB


def _recorded_camera(camera: RgbdSensor) -> RecordedCamera:
    """Returns how a camera is recorded: its intrinsics and its pose.

    These are the intrinsics and the pose of colour and label images. Depth
    images have an entry of their own only if their intrinsics or pose differ
    from these.
    """
    color, depth = (
        RecordedCamera(core.intrinsics(), core.sensor_pose_in_camera_body())
        for core in (
            camera.default_color_render_camera().core(),
            camera.default_depth_render_camera().core(),
        )
    )
    if _projection(color) == _projection(depth):
        return color
    return color._replace(depth=depth)


def _projection(camera: RecordedCamera) -> tuple:
    """Returns size, intrinsics and pose, which are equal for equal images."""
    info = camera.info
    return (
        info.width(),
        info.height(),
        info.intrinsic_matrix().tobytes(),
        camera.X_BC.GetAsMatrix34().tobytes(),
    )
