"""A car on four springs, from its files, and its ride over a rough road."""

from dataclasses import dataclass
import math
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from pydrake.math import inv
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import PrismaticJoint

from cns_drake.motion.body_ride import NUM_COORDINATES, BodyRide
from cns_drake.motion.road_profile import RoadProfile
from cns_drake.motion.trajectory import Trajectory
from evaluation.base import product, read_yaml, rotated, validated

# Longest time step [s]: a fifteenth of the period of the wheels on their tyres.
_STEP = 0.005
# Greatest distance that a wheel travels in a step, so that the waves of the
# profile are resolved [m].
_STRIDE = 0.1
# Time for the body to come to rest at the end of the drive [s].
_AFTERWARDS = 3.0
# Acceleration of gravity [m/s^2].
_GRAVITY = 9.81
# Number of terms of the Taylor series of a matrix exponential, after the first.
_TERMS = 15


class AxleRates(BaseModel):
    """A rate, such as the stiffness of a spring, for each of the two axles.

    Attributes:
        front: rate on the front axle.
        rear: rate on the rear axle.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    front: float = Field(ge=0.0, allow_inf_nan=False)
    rear: float = Field(ge=0.0, allow_inf_nan=False)


class SuspensionRates(BaseModel):
    """Rates (stiffness, damping) of springs, dampers, tyres and roll bars.

    Attributes:
        spring_rate: rate of one wheel's spring [N/m].
        damping_rate: rate of one wheel's damper [N s/m].
        tyre_rate: rate of one tyre [N/m].
        roll_bar_rate: rate of an axle's anti-roll bar [N m/rad].
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    spring_rate: AxleRates
    damping_rate: AxleRates
    tyre_rate: AxleRates
    roll_bar_rate: AxleRates


def load_suspension_rates(path: Path) -> SuspensionRates:
    """Reads the rates of a suspension from a YAML file.

    Raises:
        InputError: the file cannot be used.
    """
    return validated(SuspensionRates, read_yaml(path), path)


@dataclass(frozen=True)
class CarMasses:
    """The masses of a car's body and its W wheels, and their positions.

    Attributes:
        body: mass of the body [kg].
        roll_inertia, pitch_inertia: moments of inertia of the body about its
            centre of mass [kg m^2].
        center: x and z of the body's centre of mass in the vehicle frame B [m].
        wheels: (W,) masses of the wheels, moving parts included [kg].
        p_BWset: (W, 2) x and y of the wheels in B [m].
    """

    body: float
    roll_inertia: float
    pitch_inertia: float
    center: tuple[float, float]
    wheels: np.ndarray
    p_BWset: np.ndarray


def load_car_masses(vehicle: Path) -> CarMasses:
    """Reads the masses of a car from an SDF model.

    The floating base of the model is the car's body, and each link on a joint
    along z is a wheel.

    Raises:
        RuntimeError: the model cannot be used.
    """
    plant = MultibodyPlant(time_step=0.0)
    (model,) = Parser(plant).AddModels(str(vehicle))
    plant.Finalize()
    base = plant.GetUniqueFloatingBaseBodyOrThrow(model)
    inertia = base.default_spatial_inertia()
    center = inertia.get_com()
    moments = inertia.Shift(center).CalcRotationalInertia().get_moments()
    context = plant.CreateDefaultContext()
    masses, places = [], []
    for index in plant.GetJointIndices(model):
        joint = plant.get_joint(index)
        if isinstance(joint, PrismaticJoint):
            moved = plant.GetBodiesKinematicallyAffectedBy([index])
            masses.append(sum(plant.get_body(k).default_mass() for k in moved))
            X_BW = joint.frame_on_child().CalcPose(context, base.body_frame())
            places.append(X_BW.translation()[:2])
    return CarMasses(
        body=inertia.get_mass(),
        roll_inertia=moments[0],
        pitch_inertia=moments[1],
        center=(center[0], center[2]),
        wheels=np.array(masses),
        p_BWset=np.array(places),
    )


class Suspension:
    """The linear full-car model of vehicle dynamics.

    The body heaves, rolls and pitches. Each wheel moves up and down between its
    spring and its tyre. The coordinates are the heave of the body, positive
    upwards [m]; the roll of the body about x of B, positive with the right side
    down [rad]; the pitch of the body about y of B, positive with the nose down
    [rad]; and the heights of the wheels [m]. All coordinates are zero at rest
    on a level road. The body rotates about the point on the ground below its
    centre of mass. The model has no anti-dive or anti-squat geometry.

    Attributes:
        masses: masses of the car.
    """

    # The source of the shipped rates has the same centre of rotation.
    #
    # Let q be the vector of the coordinates, and g q the stretch of a spring
    # with the rate k, where g is a row vector. The stiffness matrix is the sum
    # of k g' g over all springs, and the damping matrix is the same sum over
    # all dampers.

    def __init__(self, masses: CarMasses, rates: SuspensionRates):
        """Sets up the equations of motion of a car."""
        self.masses = masses
        x, y = masses.p_BWset.T
        count = len(x)
        size = NUM_COORDINATES + count
        center_x, height = masses.center
        front = x > center_x

        def each(axles: AxleRates) -> np.ndarray:
            return np.where(front, axles.front, axles.rear)

        # How the coordinates stretch each spring and each tyre.
        tyres = np.eye(size)[NUM_COORDINATES:]
        springs = np.column_stack(
            [np.ones(count), y, center_x - x, -np.eye(count)]
        )
        self._mass = np.array(
            [
                masses.body,
                masses.roll_inertia + masses.body * height**2,
                masses.pitch_inertia + masses.body * height**2,
                *masses.wheels,
            ]
        )
        stiffness = product(springs.T * each(rates.spring_rate), springs)
        stiffness += product(tyres.T * each(rates.tyre_rate), tyres)
        for axle, rate in (
            (front, rates.roll_bar_rate.front),
            (~front, rates.roll_bar_rate.rear),
        ):
            # The bar is twisted by the difference between the body's roll and
            # the axle's roll.
            twist = (np.sign(y[axle, None]) * springs[axle]).sum(axis=0)
            twist /= np.abs(y[axle]).sum()
            stiffness += rate * np.outer(twist, twist)
        # The weight of a tilted body tilts it further.
        overhang = masses.body * _GRAVITY * height
        stiffness -= np.diag([0.0, overhang, overhang, *np.zeros(count)])
        self._stiffness = stiffness
        self._damping = product(springs.T * each(rates.damping_rate), springs)
        # How the inputs (heights of the road below the wheels, and specific
        # force in B minus its value at rest) act on the coordinates.
        self._loads = np.zeros((size, count + 3))
        self._loads[:, :count] = tyres.T * each(rates.tyre_rate)
        self._loads[2, count] = -masses.body * height
        self._loads[1, count + 1] = masses.body * height
        self._loads[0, count + 2] = -masses.body
        self._loads[NUM_COORDINATES:, count + 2] = -masses.wheels

    def at_rest(self, inputs: np.ndarray) -> np.ndarray:
        """Returns heave [m], roll and pitch [rad] of the body at rest, (3,).

        Args:
            inputs: (W + 3,) constant loads: height of the road below each of
                the W wheels [m], then, along x, y and z of B, the specific
                force minus the specific force of a car at rest on a level road
                [m/s^2].
        """
        return rotated(inv(self._stiffness), rotated(self._loads, inputs))

    def respond(
        self, inputs: np.ndarray, step: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the motion of the body under given loads.

        At first, the body rests under the loads of the first row. The solution
        is exact for loads that change linearly between two rows.

        Args:
            inputs: (N, W + 3) loads at N times, for a car with W wheels. The
                columns are the same as in `Suspension.at_rest`.
            step: time between two rows [s].

        Returns:
            Three arrays (N, 3): heave [m], roll and pitch [rad]; their first
            derivatives; and their second derivatives.
        """
        size, count = self._loads.shape
        to_rates = np.hstack([-self._stiffness, -self._damping, self._loads])
        to_rates /= self._mass[:, None]
        # The motion within a step is the motion of a linear system whose state
        # also contains the inputs and their slopes (Franklin, Powell and
        # Workman, Digital Control of Dynamic Systems, the triangle hold).
        whole = np.zeros((2 * (size + count), 2 * (size + count)))
        whole[:size, size : 2 * size] = step * np.eye(size)
        whole[size : 2 * size, : 2 * size + count] = step * to_rates
        whole[2 * size : -count, -count:] = np.eye(count)
        flow, by_input, by_slope = np.split(
            _exponential(whole)[: 2 * size],
            [2 * size, 2 * size + count],
            axis=1,
        )
        driven = product(inputs[:-1], (by_input - by_slope).T)
        driven += product(inputs[1:], by_slope.T)
        states = np.zeros((len(inputs), 2 * size))
        states[0, :size] = self.at_rest(inputs[0])
        for k, drive in enumerate(driven):
            states[k + 1] = (flow * states[k]).sum(axis=1) + drive
        body = slice(NUM_COORDINATES)
        all_values = np.hstack([states, inputs])
        return (
            states[:, body],
            states[:, size:][:, body],
            product(all_values, to_rates[body].T),
        )


def _exponential(matrix: np.ndarray) -> np.ndarray:
    """Returns exp(matrix), from a Taylor series that is squared repeatedly.

    The result has the same bits on every processor, unlike SciPy's `expm`.
    """
    _, exponent = math.frexp(np.abs(matrix).sum(axis=1).max())
    squarings = max(exponent + 1, 0)
    part = np.ldexp(matrix, -squarings)
    term = result = np.eye(len(matrix))
    # The norm of `part` is at most 1/2, so that the omitted terms are below
    # rounding.
    for k in range(1, _TERMS + 1):
        term = product(term, part) / k
        result = result + term
    for _ in range(squarings):
        result = product(result, result)
    return result


def ride_on_springs(
    trajectory: Trajectory,
    suspension: Suspension,
    profile: RoadProfile,
    *,
    crossfall: float = 0.0,
) -> Trajectory:
    """Returns a drive in which the body heaves, rolls and pitches.

    The vehicle follows the path of `trajectory` at the same speed. The
    vehicle's springs react to the acceleration of the body's centre of mass, to
    gravity on slopes, and to the road profile below each wheel. The road also
    falls to the right with the slope `crossfall` [m/m].
    """
    masses = suspension.masses
    end = trajectory.duration + _AFTERWARDS
    # The path's parameter and its length are nearly equal.
    _, speeds, _ = trajectory.path_parameter(np.arange(0.0, end, _STEP))
    step = min(_STEP, _STRIDE / speeds.max())
    frame = trajectory.path_motion(np.arange(0.0, end, step))
    # The profile below each wheel at each time.
    p_FQ_Wset = product(frame.R[:, :2, :2], masses.p_BWset.T)
    p_WQset = frame.p[:, :2, None] + p_FQ_Wset
    heights = profile.heights(p_WQset.transpose(0, 2, 1).reshape(-1, 2))
    heights = heights.reshape(len(p_WQset), -1)
    heights = heights + crossfall * masses.p_BWset[:, 1]
    x, z = masses.center
    a_WG = frame.acceleration_at(np.array([x, 0.0, z]))
    gravity = np.array([0.0, 0.0, -_GRAVITY])
    force_F = rotated(frame.R.transpose(0, 2, 1), a_WG - gravity)
    inputs = np.column_stack([heights, force_F + gravity])
    return trajectory.with_ride(
        BodyRide(*suspension.respond(inputs, step), step, x)
    )
