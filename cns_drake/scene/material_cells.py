"""Cells `material` of the structure table: the materials of a structure."""

from collections import Counter
from collections.abc import Mapping
from urllib.parse import quote, unquote

from cns_drake.scene.materials import MATERIALS, USUAL_MATERIALS


def shortened(parts: Mapping[str, str]) -> dict[str, str]:
    """Returns the materials of all parts of a structure, in fewer entries.

    Args:
        parts: name of each part -> name of its material.

    Returns:
        Name of a part -> name of its material. An empty name stands for all
        parts that are not named: it has the material of most parts.
    """
    if not parts:
        return {}
    ((most, _),) = Counter(parts.values()).most_common(1)
    return {"": most, **{p: m for p, m in parts.items() if m != most}}


def write_materials(semantic_class: str, materials: Mapping[str, str]) -> str:
    """Returns the cell `material` of a structure's row in the structure table.

    The cell is a list of words. The first word is the material of the parts
    that are not named, and is left out if this is the usual material of the
    class. For each part with another material, a word `part=material` follows.
    `read_materials` reads the cell.

    Args:
        semantic_class: class of the structure.
        materials: name of a part -> name of its material. An empty name stands
            for all parts that are not named; without it, these parts have the
            usual material of the class.
    """
    usual = USUAL_MATERIALS[semantic_class]
    others = materials.get("", usual)
    words = [others] if others != usual else []
    words += [material_word(p, m) for p, m in materials.items() if m != others]
    return " ".join(words)


def material_word(part: str, material: str) -> str:
    """Returns the word `part=material` for a cell `material`.

    Spaces and other special characters of the part's name are percent-encoded.
    """
    return f"{quote(part)}={material}"


def read_materials(text: str) -> dict[str, str]:
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
