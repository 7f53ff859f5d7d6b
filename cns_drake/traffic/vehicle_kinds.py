"""Kinds of vehicles in traffic: sizes, shares and driving parameters."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class VehicleKind:
    """A kind of vehicle.

    The parameters are those of the Intelligent Driver Model: Treiber,
    Hennecke, Helbing, "Congested traffic states in empirical observations
    and microscopic simulations", Phys. Rev. E 62 (2000).

    Attributes:
        name: name of the kind; the names of its meshes begin with it.
        semantic_class: a key of `cns_drake.scene.semantics.CLASS_IDS`.
        share: part of all vehicles, relative to the other kinds.
        size: length, width, height of the box about the vehicle, mirrors and
            rider included [m].
        axles: x of the rear and front axle from the middle of the box [m].
        speed_factor: speed on a free road, as a part of the limit.
        top_speed: its greatest speed [m/s].
        acceleration: a_max of the model [m/s^2].
        deceleration: b of the model, the comfortable one [m/s^2].
        headway: T of the model [s].
    """

    name: str
    semantic_class: str
    share: float
    size: tuple[float, float, float]
    axles: tuple[float, float]
    speed_factor: float = 0.95
    top_speed: float = 30.0
    acceleration: float = 1.5
    deceleration: float = 2.0
    headway: float = 1.3

    @property
    def is_large(self) -> bool:
        """Whether it sweeps more than its lane in a turn."""
        return self.size[0] > 5.8


# Gap to the vehicle ahead at standstill, s0 of the model [m].
STANDSTILL_GAP = 2.0

KINDS = (
    VehicleKind("city_car", "car", 0.14, (3.66, 1.88, 1.53), (-1.18, 1.17)),
    VehicleKind("hatchback", "car", 0.16, (4.25, 2.0, 1.48), (-1.32, 1.3)),
    VehicleKind("saloon", "car", 0.12, (4.8, 2.05, 1.46), (-1.4, 1.42)),
    VehicleKind("estate", "car", 0.1, (4.75, 2.04, 1.49), (-1.38, 1.4)),
    VehicleKind("suv", "car", 0.12, (4.65, 2.11, 1.71), (-1.36, 1.36)),
    VehicleKind("van", "car", 0.1, (5.55, 2.24, 2.46), (-1.6, 1.75)),
    VehicleKind(
        "box_truck",
        "truck",
        0.07,
        (6.6, 2.34, 3.05),
        (-1.75, 2.15),
        speed_factor=0.85,
        acceleration=1.0,
        headway=1.6,
    ),
    VehicleKind(
        "bus",
        "bus",
        0.04,
        (11.26, 2.72, 3.06),
        (-2.9, 2.9),
        speed_factor=0.8,
        acceleration=0.9,
        headway=1.6,
    ),
    VehicleKind(
        "motorcycle",
        "motorcyclist",
        0.06,
        (2.2, 0.9, 1.75),
        (-0.75, 0.7),
        acceleration=2.0,
    ),
    VehicleKind(
        "bicycle",
        "bicyclist",
        0.09,
        (1.8, 0.7, 1.85),
        (-0.52, 0.52),
        top_speed=5.5,
        acceleration=1.0,
        deceleration=1.5,
        headway=1.0,
    ),
)
LARGEST = max(KINDS, key=lambda kind: kind.size[0])
# Box that contains every small vehicle [m].
SMALL_SIZE = (5.6, 2.26)


def draw_kinds(count: int, rng: np.random.Generator) -> np.ndarray:
    """Returns the (count,) indices into `KINDS` of a mix of vehicles."""
    shares = np.array([kind.share for kind in KINDS])
    return rng.choice(len(KINDS), size=count, p=shares / shares.sum())
