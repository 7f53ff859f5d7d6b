"""The masses of a car and the rates of its suspension, read from files."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import PrismaticJoint

from cns_drake.base import read_yaml, validated


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
