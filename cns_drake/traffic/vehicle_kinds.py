"""Kinds of vehicles in traffic: sizes, shares and driving parameters."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

from cns_drake.base import parse_yaml

# Longer vehicles leave their lane in turns [m].
_LARGE_FROM = 5.8


@dataclass(frozen=True)
class VehicleKind:
    """A kind of vehicle.

    The driving parameters are the parameters of the Intelligent Driver Model:
    Treiber, Hennecke, Helbing, "Congested traffic states in empirical
    observations and microscopic simulations", Phys. Rev. E 62 (2000).

    Attributes:
        name: name of the kind, with which the names of the kind's meshes begin.
        semantic_class: a key of `cns_drake.scene.semantics.CLASS_IDS`.
        share: weight in the random choice of kinds.
        size: length, width and height of the vehicle's box, mirrors and rider
            included [m].
        axles: x of the rear and front axle from the middle of the box [m].
        speed_factor: speed on a free road, as a share of the limit.
        top_speed: greatest speed of the kind [m/s].
        acceleration: a_max of the model [m/s^2].
        deceleration: b of the model, the comfortable deceleration [m/s^2].
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
        """Whether the vehicle needs more than its lane's width in a turn."""
        return self.size[0] > _LARGE_FROM


# Gap to a standing vehicle ahead, s0 of the model [m].
STANDSTILL_GAP = 2.0

_TABLE = parse_yaml(Path(__file__).with_name("vehicle_kinds.yaml").read_bytes())
KINDS = TypeAdapter(tuple[VehicleKind, ...]).validate_python(
    [{"name": name, **fields} for name, fields in _TABLE.items()]
)
LARGEST = max(KINDS, key=lambda kind: kind.size[0])
# Length and width of a box that contains every small vehicle [m].
SMALL_SIZE = (5.6, 2.26)


def draw_kinds(count: int, rng: np.random.Generator) -> np.ndarray:
    """Samples a random mix of vehicle kinds.

    Args:
        count: number of vehicles.
        rng: the random generator.

    Returns:
        (count,) indices into `cns_drake.traffic.vehicle_kinds.KINDS`.
    """
    shares = np.array([kind.share for kind in KINDS])
    return rng.choice(len(KINDS), size=count, p=shares / shares.sum())
