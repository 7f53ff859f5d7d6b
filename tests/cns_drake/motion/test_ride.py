"""A drive on springs: derivatives, closed forms, and one road for all."""

from functools import cache

from helpers.drives import (
    CAREFUL,
    check_derivatives,
    helix_points,
    lane_path,
    spatial_acceleration,
    spatial_velocity,
    wavy_points,
)
import numpy as np
import pytest

from cns_drake.motion import (
    RoadProfile,
    Speeds,
    Suspension,
    Trajectory,
    load_car_masses,
    load_suspension_rates,
    ride_on_springs,
    vehicle_file,
)


class Level:
    """A road without waves."""

    def heights(self, p_WQset):
        return np.zeros(len(p_WQset))


@cache
def car():
    return Suspension(
        load_car_masses(vehicle_file()),
        load_suspension_rates(vehicle_file().with_name("suspension.yaml")),
    )


def ride(points, profile, speeds=CAREFUL):
    return ride_on_springs(
        Trajectory(lane_path(points), speeds), car(), profile
    )


def straight(start, end, angle=0.4):
    """Returns points 2 m apart on a line through (20, -30)."""
    s = np.arange(start, end, 2.0)
    along = np.outer(s, [np.cos(angle), np.sin(angle), 0.0])
    return np.array([20.0, -30.0, 0.0]) + along


def test_velocity_and_acceleration_are_derivatives_of_the_pose():
    trajectory = ride(wavy_points(1), RoadProfile("D", 2))
    times = np.linspace(0.5, trajectory.duration, 41)
    check_derivatives(
        trajectory, times, velocity_atol=1e-5, acceleration_atol=1e-3
    )
    R_WB, p_WB = trajectory.poses(times)
    for k, t in enumerate(times):
        X_WB = trajectory.pose(t)
        np.testing.assert_allclose(
            X_WB.rotation().matrix(), R_WB[k], atol=1e-12
        )
        np.testing.assert_allclose(X_WB.translation(), p_WB[k], atol=1e-12)


def test_accelerations_have_no_jumps():
    trajectory = ride(wavy_points(4), RoadProfile("E", 5))
    middle = trajectory.duration / 2
    for span in (1e-2, 1e-3, 1e-4, 1e-5):
        A = np.array(
            [
                spatial_acceleration(trajectory, t).get_coeffs()
                for t in np.linspace(middle, middle + span, 50)
            ]
        )
        # The wheels swing on their tyres at 13 Hz, which limits the rate.
        assert np.ptp(A, axis=0).max() < 40.0 * 2 * np.pi * 13.0 * span


def test_the_body_rests_before_and_after_the_drive():
    trajectory = ride(wavy_points(2), RoadProfile("B", 1))
    V = spatial_velocity(trajectory, 0.0).get_coeffs()
    np.testing.assert_allclose(V, 0.0, atol=1e-9)
    V = spatial_velocity(trajectory, trajectory.duration + 5.0).get_coeffs()
    np.testing.assert_allclose(V, 0.0, atol=1e-3)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_steady_acceleration_tilts_the_body(sign):
    # The body has time to settle: 2 m/s^2 up to 30 m/s and down again.
    speeds = Speeds(
        cruise=30.0, longitudinal_acceleration=2.0, lateral_acceleration=3.0
    )
    trajectory = ride(straight(0.0, 600.0), Level(), speeds)
    t = trajectory.duration / 2 - sign * 5.0
    a = trajectory.path_motion([t]).a[0] @ [np.cos(0.4), np.sin(0.4), 0.0]
    assert a == pytest.approx(2.0 * sign, rel=0.01)
    R_FB = trajectory.path_motion([t]).R[0].T @ trajectory.poses([t])[0][0]
    pitch = np.arctan2(-R_FB[2, 0], R_FB[0, 0])

    # Two axles that carry the body over springs in series with tyres.
    k = 2 * 21900.0 * 190000.0 / (21900.0 + 190000.0)
    m = 1480.0
    h = 0.55
    front = 1.5
    rear = 1.3
    # Moments about y: heave and pitch are coupled unless both arms are alike.
    stiffness = np.array(
        [
            [2 * k, k * (rear - front)],
            [k * (rear - front), k * (front**2 + rear**2) - m * 9.81 * h],
        ]
    )
    heave, expected = np.linalg.solve(stiffness, [0.0, -m * h * a])
    assert pitch == pytest.approx(expected, rel=0.01)
    # Nose down while it brakes.
    assert np.sign(pitch) == -sign
    # The body turns about the ground below its centre of mass.
    p_WB = trajectory.poses([t])[1][0]
    expected = heave + 1.3 * np.sin(pitch)
    assert p_WB[2] == pytest.approx(expected, abs=1e-4)


def test_bends_and_slopes_tilt_the_body_by_the_specific_force():
    radius = 30.0
    slope = 0.1
    trajectory = ride(helix_points(radius, slope, 160), Level())
    t = trajectory.duration / 2
    moment = trajectory.at(t)
    speed = moment.jet.speed[0] * moment.rate[0]
    # The radius of the path at the body's centre of mass.
    lateral = speed**2 / radius / (1 + slope**2)
    _, roll, pitch = moment.ride.q[0]
    one_g = 9.81 * np.eye(7)
    roll_per_g = car().at_rest(one_g[5])[1]
    assert roll == pytest.approx(roll_per_g * lateral / 9.81, rel=0.03)
    # Uphill the load moves back.
    climb = np.arctan(slope)
    pitch_per_g = car().at_rest(one_g[4])[2]
    assert pitch == pytest.approx(pitch_per_g * np.sin(climb), rel=0.1)


def test_a_second_drive_over_the_same_spot_feels_the_same_road():
    speeds = Speeds(
        cruise=8.0, longitudinal_acceleration=2.0, lateral_acceleration=2.0
    )
    felt = []
    for start in (0.0, -46.0):
        trajectory = ride(straight(start, 300.0), RoadProfile("B", 9), speeds)
        times = np.arange(0.0, trajectory.duration, 0.01)
        moments = trajectory.at(times)
        along = trajectory.travelled(times) + start
        places = np.arange(120.0, 200.0, 0.1)
        felt.append(
            np.array([np.interp(places, along, q) for q in moments.ride.q.T])
        )
    first, second = felt
    assert np.ptp(first, axis=1).min() > 2e-3
    np.testing.assert_allclose(first, second, atol=2e-5)
    # Another road is another ride.
    other = ride(straight(0.0, 300.0), RoadProfile("B", 10), speeds)
    assert (
        np.abs(other.at(20.0).ride.q - trajectory.at(20.0).ride.q).max() > 1e-3
    )


def test_the_drive_without_a_ride_is_as_it_was():
    points = wavy_points(3)
    rigid = Trajectory(lane_path(points), CAREFUL)
    before = rigid.pose(9.0).GetAsMatrix4()
    riding = ride_on_springs(rigid, car(), RoadProfile("A", 1))
    np.testing.assert_array_equal(rigid.pose(9.0).GetAsMatrix4(), before)
    assert (riding.duration, riding.length) == (rigid.duration, rigid.length)
    assert not np.array_equal(riding.pose(9.0).GetAsMatrix4(), before)


def test_a_crossfall_rolls_the_body_as_a_tilted_road_does():
    fall = 0.03

    class Falling:
        """A level road, but for a plane that falls to the right of the way."""

        def heights(self, p_WQset):
            left = np.array([-np.sin(0.4), np.cos(0.4)])
            return fall * (p_WQset - [20.0, -30.0]) @ left

    points = straight(0.0, 200.0)
    level = Trajectory(lane_path(points), CAREFUL)
    rides = [
        ride_on_springs(level, car(), Level(), crossfall=fall),
        ride_on_springs(level, car(), Falling()),
    ]
    times = np.linspace(0.0, level.duration, 50)
    leaning, expected = (one.at(times).ride.q for one in rides)
    np.testing.assert_allclose(leaning, expected, atol=1e-9)
    # The right side is down, a little more than the road: the weight leans.
    _, roll, _ = leaning[0]
    assert fall < roll < 1.2 * fall
