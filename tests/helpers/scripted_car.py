"""A car in a diagram whose motion and measurements are functions of time."""

from types import SimpleNamespace

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from cns_drake.pictures import MeshcatRecorder
from cns_drake.sensors import POINT_DTYPE


class ScriptedCar(LeafSystem):
    """Outputs that are functions of time, as of a prescribed motion.

    Args:
        X_WB_at: pose.
        V_WB_B_at: angular and linear velocity, one after the other.
        imu_at: specific force and angular velocity.
        scans_at: name of a LiDAR -> its scan.
        q_at: positions of the plant of a world, if there is one.
    """

    def __init__(self, X_WB_at, V_WB_B_at, imu_at, scans_at, q_at=None):
        super().__init__()
        # One object is reused for all times, as a careless system may do.
        self._X_WB = RigidTransform()
        self._at = X_WB_at, V_WB_B_at
        time = {self.time_ticket()}
        vectors = {
            name: lambda t, k=k: imu_at(t)[k]
            for k, name in enumerate(("specific_force", "angular_velocity"))
        }
        if q_at is not None:
            vectors["position"] = q_at
        for name, value_at in vectors.items():
            self.DeclareVectorOutputPort(
                name,
                len(value_at(0.0)),
                lambda context, out, value_at=value_at: out.SetFromVector(
                    value_at(context.get_time())
                ),
                time,
            )
        values = {f"{name}_scan": at for name, at in scans_at.items()}
        for name, value_at in {**values, "odometry": self._odometry_at}.items():
            self.DeclareAbstractOutputPort(
                name,
                lambda: Value(object()),
                lambda context, out, value_at=value_at: out.set_value(
                    value_at(context.get_time())
                ),
                time,
            )

    def _odometry_at(self, time):
        X_WB_at, V_WB_B_at = self._at
        V_WB_B = np.array(V_WB_B_at(time), float)
        self._X_WB.set(X_WB_at(time).rotation(), X_WB_at(time).translation())
        return SimpleNamespace(
            X_WB=self._X_WB, V_WB_B=SpatialVelocity(V_WB_B[:3], V_WB_B[3:])
        )


def scan_of(p_SRset):
    """A scan of points (N, 3)."""
    scan = np.zeros(len(p_SRset), POINT_DTYPE)
    scan["x"], scan["y"], scan["z"] = np.transpose(p_SRset)
    return scan


def film(
    world,
    X_WB_at,
    V_WB_B_at,
    imu_at,
    scans_at,
    num_frames,
    *,
    period,
    angles_at=None,
    **options,
):
    """Returns a recorder that has seen a drive of so many frames.

    Args:
        world: a world and a vehicle.
        X_WB_at, V_WB_B_at, imu_at, scans_at: see `ScriptedCar`.
        num_frames: number of frames.
        period: time between two frames [s].
        angles_at: name of a joint of the vehicle -> its angle over time.
        options: of MeshcatRecorder.
    """
    plant = world.plant
    scratch = plant.CreateDefaultContext()

    def q_at(time):
        base = plant.GetBodyByName("base_link")
        plant.SetFreeBodyPose(scratch, base, X_WB_at(time))
        for name, angle_at in (angles_at or {}).items():
            plant.GetJointByName(name).set_angle(scratch, angle_at(time))
        return plant.GetPositions(scratch)

    builder = DiagramBuilder()
    scene_graph = builder.AddSystem(world.scene_graph)
    car = builder.AddSystem(
        ScriptedCar(X_WB_at, V_WB_B_at, imu_at, scans_at, q_at)
    )
    to_pose = builder.AddSystem(MultibodyPositionToGeometryPose(plant))
    recorder = builder.AddSystem(
        MeshcatRecorder(world, period=period, num_frames=num_frames, **options)
    )
    builder.Connect(car.GetOutputPort("position"), to_pose.get_input_port())
    builder.Connect(
        to_pose.get_output_port(),
        scene_graph.get_source_pose_port(plant.get_source_id()),
    )
    ports = {"geometry_query": scene_graph.get_query_output_port()}
    for i in range(recorder.num_input_ports()):
        port = recorder.get_input_port(i)
        name = port.get_name()
        builder.Connect(ports.get(name) or car.GetOutputPort(name), port)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo((num_frames - 1) * period)
    return recorder
