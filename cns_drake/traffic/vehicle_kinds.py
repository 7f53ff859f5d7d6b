"""Kinds of vehicles in traffic: their shares, sizes and axles."""

from dataclasses import dataclass
from pathlib import Path

from pydantic import TypeAdapter

from cns_drake.base import parse_yaml


@dataclass(frozen=True)
class VehicleKind:
    """A kind of vehicle.

    Attributes:
        name: name of the kind, with which the names of the kind's meshes begin.
        semantic_class: a key of `cns_drake.scene.semantics.CLASS_IDS`.
        share: weight in the random choice of kinds.
        size: length, width and height of the vehicle's box, mirrors and rider
            included [m].
        axles: x of the rear and front axle from the middle of the box [m].
    """

    name: str
    semantic_class: str
    share: float
    size: tuple[float, float, float]
    axles: tuple[float, float]


_TABLE = parse_yaml(Path(__file__).with_name("vehicle_kinds.yaml").read_bytes())
KINDS = TypeAdapter(tuple[VehicleKind, ...]).validate_python(
    [{"name": name, **fields} for name, fields in _TABLE.items()]
)
