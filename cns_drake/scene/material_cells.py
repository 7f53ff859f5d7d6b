"""Cells `material` of the structure table: the materials of a structure."""

from collections import Counter
from collections.abc import Mapping
from urllib.parse import quote, unquote

from cns_drake.scene.materials import MATERIALS, USUAL_MATERIALS


def write_materials(semantic_class: str, parts: Mapping[str, str]) -> str:
    """Returns the cell `material` of a structure's row in the structure table.

    The cell is a list of words. The first word is the material of most parts,
    and is left out if this is the usual material of the class. For each part
    with another material, a word `part=material` follows. `read_materials`
    reads the cell.

    Args:
        semantic_class: class of the structure.
        parts: name of a part -> name of its material.
    """
    usual = USUAL_MATERIALS[semantic_class]
    (most, _), *_ = Counter(parts.values()).most_common(1) or [(usual, 0)]
    words = [most] if most != usual else []
    words += [material_word(p, m) for p, m in parts.items() if m != most]
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
