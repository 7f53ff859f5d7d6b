"""The IMU against closed forms and against the drive itself."""

from helpers.drives import (
    CAREFUL,
    helix_points,
    lane_path,
    shipped_drive,
    smoothed_radius,
    spatial_velocity,
)
from helpers.imu_integration import integrate_imu
import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder
import pytest

from cns_drake.motion import Trajectory, VehicleMotion, vehicle_file
from cns_drake.sensors import add_imu, add_odometry

GRAVITY = 9.81


class Station:
    """A vehicle with an IMU and odometry, with readings at any time."""

    def __init__(self, trajectory, X_BI):
        plant = MultibodyPlant(time_step=0.0)
        vehicle = Parser(plant).AddModels(str(vehicle_file()))[0]
        plant.Finalize()
        base = plant.GetBodyByName("base_link")
        builder = DiagramBuilder()
        motion = builder.AddNamedSystem(
            "vehicle_motion", VehicleMotion(plant, vehicle, trajectory)
        )
        self.imu = add_imu(builder, base, X_BI, motion=motion, name="roof_imu")
        self.odometry = add_odometry(builder, base, motion=motion)
        self.diagram = builder.Build()
        self._context = self.diagram.CreateDefaultContext()

    def read(self, time):
        """Returns specific force, angular velocity and odometry."""
        self._context.SetTime(time)
        return tuple(
            port.Eval(system.GetMyContextFromRoot(self._context))
            for system, port in (
                (sensor, sensor.GetOutputPort(name))
                for sensor, name in (
                    (self.imu.accelerometer, "measurement"),
                    (self.imu.gyroscope, "measurement"),
                    (self.odometry, "odometry"),
                )
            )
        )


def test_the_systems_are_named():
    trajectory = Trajectory(lane_path(helix_points(30, 0, 40)), CAREFUL)
    station = Station(trajectory, RigidTransform())
    names = {system.get_name() for system in station.diagram.GetSystems()}
    assert names == {
        "vehicle_motion",
        "roof_imu_accelerometer",
        "roof_imu_gyroscope",
        "odometry",
    }


@pytest.mark.parametrize("slope", [0.0, 0.1])
def test_a_steady_bend_with_a_lever_arm(slope):
    radius = 30.0
    trajectory = Trajectory(
        lane_path(helix_points(radius, slope, 120)), CAREFUL
    )
    X_BI = RigidTransform(RollPitchYaw(0.3, -0.2, 1.1), [-1.0, 0.4, 1.6])
    force, rate, _ = Station(trajectory, X_BI).read(trajectory.duration / 2)

    u, du = (
        v[0] for v in trajectory.path_parameter(trajectory.duration / 2)[:2]
    )
    flat = 1 / np.hypot(1.0, slope)
    r = smoothed_radius(radius, slope)
    w = flat / radius * du
    climb = np.arctan2(slope * flat, r * flat / radius)
    heading = 0.3 + flat * u / radius + np.pi / 2
    R_WB = RollPitchYaw(0, -climb, heading).ToRotationMatrix()
    # In a body that turns about a fixed vertical axis, every point is
    # accelerated to that axis by w^2 times its distance.
    p_BA = R_WB.matrix() @ X_BI.translation()
    outward = np.array([np.sin(heading), -np.cos(heading), 0])
    from_axis = r * outward + [p_BA[0], p_BA[1], 0]
    R_IW = (R_WB @ X_BI.rotation()).inverse()
    expected = R_IW @ (-(w**2) * from_axis + [0, 0, GRAVITY])
    np.testing.assert_allclose(force, expected, atol=1e-6)
    np.testing.assert_allclose(rate, R_IW @ [0, 0, w], atol=1e-7)


def test_at_rest_the_specific_force_is_minus_gravity():
    trajectory = Trajectory(lane_path(helix_points(30, 0, 40)), CAREFUL)
    R_BI = RotationMatrix(RollPitchYaw(0.1, 0.2, 0.3))
    station = Station(trajectory, RigidTransform(R_BI, [-1, 0, 1.6]))
    for time in (0.0, trajectory.duration):
        force, rate, odometry = station.read(time)
        np.testing.assert_allclose(
            force, R_BI.inverse() @ [0, 0, GRAVITY], atol=1e-9
        )
        np.testing.assert_allclose(rate, np.zeros(3), atol=1e-9)
        np.testing.assert_allclose(
            odometry.V_WB_B.get_coeffs(), np.zeros(6), atol=1e-9
        )


def test_odometry_is_the_pose_and_the_twist_in_the_body():
    trajectory = Trajectory(lane_path(helix_points(30, 0.1, 80)), CAREFUL)
    time = 0.6 * trajectory.duration
    _, _, odometry = Station(trajectory, RigidTransform()).read(time)
    assert odometry.X_WB.IsNearlyEqualTo(trajectory.pose(time), 1e-12)
    V_WB = spatial_velocity(trajectory, time)
    speed = np.linalg.norm(V_WB.translational())
    # The acceleration is along x at any heading.
    np.testing.assert_allclose(
        odometry.V_WB_B.translational(), [speed, 0, 0], atol=1e-9
    )
    climb = np.arcsin(V_WB.translational()[2] / speed)
    yaw_rate = V_WB.rotational()[2]
    np.testing.assert_allclose(
        odometry.V_WB_B.rotational(),
        yaw_rate * np.array([np.sin(climb), 0, np.cos(climb)]),
        atol=1e-6,
    )


@pytest.mark.slow
@pytest.mark.night
def test_integrating_the_imu_reproduces_the_drive():
    _, _, trajectory = shipped_drive("metropolis_04")
    X_BI = RigidTransform([-1.0, 0, 1.6])
    station = Station(trajectory, X_BI)
    period = 0.05
    count = int(trajectory.duration / period) + 1
    force, rate = np.empty((count, 3)), np.empty((count, 3))
    p_WI = np.empty((count, 3))
    for i in range(count):
        force[i], rate[i], odometry = station.read(i * period)
        X_WI = odometry.X_WB @ X_BI
        p_WI[i] = X_WI.translation()
        if i == 0:
            start = X_WI
    found = integrate_imu(force, rate, period, start)
    drift = np.linalg.norm(found - p_WI, axis=1)
    # Only the 20 Hz trapezoidal rule is in error.
    print(
        f"drift {drift[-1]:.3f} m, at most {drift.max():.3f} m, over "
        f"{trajectory.length:.0f} m"
    )
    assert drift.max() < 0.1
