"""The materials of surfaces: one table for cameras and LiDARs.

Each part of a structure has a material. The structure table can name the
material of a part; otherwise the part has the usual material of the structure's
class. Reflectivities of diffuse materials are the rounded values of the
ECOSTRESS spectral library (Meerdink et al., 2019) near 0.9 um. Reflectivities
of markings, signs and plates follow from the minimum coefficients of EN 1436
(R_L 150 mcd/m2/lx at 30 m) and EN 12899-1 (class RA1, 70 cd/lx/m2), times pi.
"""

from pathlib import Path
from typing import Literal

from pydantic import BaseModel

from evaluation.base import parse_yaml


class Material(BaseModel, frozen=True, extra="forbid"):
    """A material; `materials.yaml` explains the fields."""

    name: str
    look: str
    kind: Literal["lambert", "retro", "beads", "glass", "leaves"] = "lambert"
    reflectivity: tuple[float, float]
    leaf_area_density: float = 0.0
    rough: float = 0.0
    contrast: float = 0.0
    stains: float = 0.0
    relief: float = 0.0
    tufts: float = 0.0
    swell: float = 0.0
    fittings: float = 0.0
    gets_wet: bool = False


_TABLE = parse_yaml(Path(__file__).with_name("materials.yaml").read_bytes())
# Name -> material.
MATERIALS = {
    name: Material(name=name, **fields)
    for name, fields in _TABLE["materials"].items()
}
# Semantic class -> name of the material of parts that have no other one.
USUAL_MATERIALS: dict[str, str] = _TABLE["of_classes"]
