"""The materials of surfaces: one table for cameras and LiDARs.

Each part of a structure has a material. The structure table can name the
material of a part; otherwise the part has the usual material of the structure's
class. Reflectivities of diffuse materials are those of the ECOSTRESS spectral
library (Meerdink et al., 2019) near 0.9 um, rounded; those of markings, signs
and plates follow from the minimum coefficients of EN 1436 (R_L 150 mcd/m2/lx at
30 m) and EN 12899-1 (class RA1, 70 cd/lx/m2), times pi.
"""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Literal
from urllib.parse import quote, unquote

from pydantic import BaseModel

from cns_drake.base.yaml_files import parse_yaml


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
OF_CLASSES: dict[str, str] = _TABLE["of_classes"]


def as_cell(semantic_class: str, parts: Mapping[str, str]) -> str:
    """Returns the cell `material` of a structure's row in the structure table.

    The cell is a list of words. The first word is the material of most parts,
    and is left out if this is the usual material of the class. For each part
    with another material, a word `part=material` follows. `from_cell` reads the
    cell.

    Args:
        semantic_class: class of the structure.
        parts: name of a part -> name of its material.
    """
    usual = OF_CLASSES[semantic_class]
    (most, _), *_ = Counter(parts.values()).most_common(1) or [(usual, 0)]
    words = [most] if most != usual else []
    words += [as_word(p, m) for p, m in parts.items() if m != most]
    return " ".join(words)


def as_word(part: str, material: str) -> str:
    """Returns the word `part=material` for a cell `material`.

    Spaces and other special characters of the part's name are percent-encoded.
    """
    return f"{quote(part)}={material}"


def from_cell(text: str) -> dict[str, str]:
    """Reads the cell `material` of a row in the structure table.

    Returns:
        Name of a part -> name of its material. An empty name stands for all
        parts that are not named.

    Raises:
        ValueError: a word names no known material, or a part has two materials.
    """
    found: dict[str, str] = {}
    for word in text.split():
        name, _, material = word.rpartition("=")
        part = unquote(name)
        if material not in MATERIALS:
            raise ValueError(
                f"{material!r} is none of {', '.join(sorted(MATERIALS))}"
            )
        if part in found:
            raise ValueError(f"{word!r}: a second material")
        found[part] = material
    return found
