"""Recording the sensors of any diagram."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.sensors import RgbdSensor

from cns_drake.recording.bag_writer import BagWriter
from cns_drake.recording.mcap_recorder import (
    McapRecorder,
    RecordedCamera,
    make_calibration,
    recording_topics,
)
from cns_drake.sensors.imu import Imu
from cns_drake.sensors.lidar import Lidar
from cns_drake.sensors.odometry import OdometrySensor


def add_mcap_recorder(
    builder: DiagramBuilder,
    folder: Path | str,
    *,
    period: float,
    lidars: Collection[Lidar] = (),
    cameras: Mapping[str, RgbdSensor] | None = None,
    imu: Imu | None = None,
    odometry: OdometrySensor | None = None,
    start_ns: int = 0,
    overwrite: bool = False,
    name: str = "mcap_recorder",
) -> BagWriter:
    """Adds a recorder of sensors to a diagram.

    Every LiDAR has a topic `/<name of the system>/points`; every camera
    `/<name>/color`, `depth`, `label` and `camera_info`; an IMU `/imu/data`,
    odometry `/odometry`. Sensors on the body of the odometry have their place
    there in `/tf_static`, all others where they are in `/tf`.

    Args:
        builder: of the diagram that holds the sensors.
        folder: the rosbag2 folder to write.
        period: time between frames [s].
        lidars: to record; each has a name of its own.
        cameras: name -> camera.
        imu: to record, if any.
        odometry: to record, if any.
        start_ns: the stamp of time zero [ns].
        overwrite: whether an existing recording may be replaced.
        name: of the system.

    Returns:
        The recording, a context manager that is open while the diagram is
        simulated.

    Raises:
        InputError: the folder must not be used.

    Example:
        from cns_drake import add_mcap_recorder

        bag = add_mcap_recorder(builder, "drive", lidars=[lidar], period=0.1)
        simulator = Simulator(builder.Build())
        with bag:
            simulator.AdvanceTo(10.0)
    """
    cameras = cameras or {}
    X_BSs = {lidar.get_name(): _place_of(lidar, odometry) for lidar in lidars}
    X_BI = None
    if imu is not None and odometry is not None:
        X_BI = odometry.place_of(
            imu.gyroscope.body_index(), imu.gyroscope.pose()
        )
    fixed = {key: X_BS for key, X_BS in X_BSs.items() if X_BS is not None}
    bag = BagWriter(
        Path(folder),
        recording_topics(
            X_BSs,
            camera_names=cameras,
            with_imu=imu is not None,
            with_odometry=odometry is not None,
        ),
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
            cameras={key: _describe(c) for key, c in cameras.items()},
            period=period,
            start_ns=start_ns,
        ),
    )
    ports: dict[str, OutputPort] = {}
    for lidar in lidars:
        ports[f"{lidar.get_name()}_scan"] = lidar.GetOutputPort("scan")
        ports[f"{lidar.get_name()}_pose"] = lidar.GetOutputPort("X_WS")
    for key, camera in cameras.items():
        ports[f"{key}_color"] = camera.color_image_output_port()
        ports[f"{key}_depth"] = camera.depth_image_32F_output_port()
        ports[f"{key}_label"] = camera.label_image_output_port()
        ports[f"{key}_pose"] = camera.body_pose_in_world_output_port()
    if odometry is not None:
        ports["odometry"] = odometry.GetOutputPort("odometry")
    if imu is not None:
        accelerometer, gyroscope = imu
        ports["specific_force"] = accelerometer.get_measurement_output_port()
        ports["angular_velocity"] = gyroscope.get_measurement_output_port()
    for key, port in ports.items():
        if recorder.HasInputPort(key):
            builder.Connect(port, recorder.GetInputPort(key))
    return bag


def _place_of(
    lidar: Lidar, odometry: OdometrySensor | None
) -> RigidTransform | None:
    """Returns X_BS if the LiDAR is on the body of the odometry."""
    if odometry is None or odometry.frame_id != lidar.parent_frame_id:
        return None
    return odometry.X_PB.inverse() @ lidar.X_PS


def _describe(camera: RgbdSensor) -> RecordedCamera:
    core = camera.default_color_render_camera().core()
    return RecordedCamera(core.intrinsics(), core.sensor_pose_in_camera_body())
