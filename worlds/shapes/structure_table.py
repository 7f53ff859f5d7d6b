"""The table of a world's structures, with classes and instance ids."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
import re
from urllib.parse import quote, unquote

import numpy as np

from evaluation.base import (
    MAX_INSTANCE,
    InputError,
    check_instances,
    no_such,
    read_records,
    to_number,
    whole_number,
)
from worlds.shapes.materials import MATERIALS, USUAL_MATERIALS, Material
from worlds.shapes.semantics import CLASS_IDS, moving_id

# Name of the file of a structure table, beside the world.
STRUCTURES_NAME = "structures.csv"


@dataclass(frozen=True)
class StructureEntry:
    """The entry of one structure in the structure table of a world.

    The entry states what the structure is. Its shape is a `Structure` before it
    is written to a world, and a `StructureGeometry` in a world that was loaded.

    Attributes:
        instance: instance id of the structure, as in LiDAR points, from 1 to
            65535; 0 as long as the structure has none.
        name: name of the structure.
        semantic_class: a key of `CLASS_IDS`.
        reflectivity: reflectivity of the structure's surfaces near 900 nm, from
            0 to 1; None if it follows from material and colour.
        causes: fields of the scenario's section `transient` that changed the
            structure; empty if the structure is as in the stage's file.
        materials: name of a part -> name of its material. An empty name stands
            for all parts that are not named. Without an empty name, these parts
            have the usual material of the class.
        kind: what the structure is, such as `row_house` or `bench`; by default
            the kind with which the name begins.
        tags: words that describe the structure, such as the name of its
            district.
    """

    instance: int
    name: str
    semantic_class: str
    reflectivity: float | None = None
    causes: tuple[str, ...] = ()
    materials: Mapping[str, str] = field(default_factory=dict, hash=False)
    kind: str = ""
    tags: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        kind = self.kind or kind_in_name(self.name)
        object.__setattr__(self, "kind", kind)

    @property
    def label(self) -> int:
        return CLASS_IDS[self.semantic_class]

    def material(self, part: str) -> Material:
        """Returns the material of one of the structure's parts."""
        usual = self.materials.get("", USUAL_MATERIALS[self.semantic_class])
        return MATERIALS[self.materials.get(part, usual)]

    def cells(self) -> dict[str, str]:
        """Returns the entry's cells in `structures.csv`, by column.

        `load_structure_table` reads these cells. Causes are not written.
        """
        is_in_name = self.kind == kind_in_name(self.name)
        given = self.reflectivity
        return {
            "instance": str(self.instance),
            "name": self.name,
            "class": self.semantic_class,
            "label": str(self.label),
            "tags": " ".join(self.tags),
            "reflectivity": "" if given is None else str(given),
            "material": write_materials(self.semantic_class, self.materials),
            "kind": "" if is_in_name else self.kind,
        }


class StructureTable:
    """Structures by name, with instance ids and classes.

    Structures of a world that are missing in the table get the free ids, in
    alphabetical order, and the class `unlabeled`. Structures can thus be
    distinguished even in a world without a table.
    """

    def __init__(self, entries: Iterable[StructureEntry]):
        self._by_name = {entry.name: entry for entry in entries}

    def __iter__(self) -> Iterator[StructureEntry]:
        return iter(
            sorted(self._by_name.values(), key=lambda entry: entry.instance)
        )

    def __getitem__(self, name: str) -> StructureEntry:
        return self._by_name[name]

    @property
    def last_instance(self) -> int:
        """Greatest instance id in use; 0 if there is none."""
        return max((entry.instance for entry in self), default=0)

    def joined(self, other: StructureTable) -> StructureTable:
        """Returns a table with the entries of this and of another table."""
        return StructureTable([*self, *other])

    def completed(self, names: Iterable[str]) -> StructureTable:
        """Returns the table, with entries added for the names that it lacks.

        Raises:
            InputError: there are more structures than instance ids.
        """
        entries = list(self)
        free = self.last_instance + 1
        for name in sorted(set(names) - self._by_name.keys()):
            entries.append(StructureEntry(free, name, "unlabeled"))
            free += 1
        check_instances(free - 1)
        return StructureTable(entries)

    def labels(
        self, names: Sequence[str]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the labels and instance ids of G geometries, by structure.

        Args:
            names: name of each geometry's structure.

        Returns:
            (G,) uint16 class, class while it moves, and instance id.
        """
        table = self.completed(names)
        entries = [table[name] for name in names]
        return (
            np.array([one.label for one in entries], np.uint16),
            np.array(
                [moving_id(one.semantic_class) for one in entries], np.uint16
            ),
            np.array([one.instance for one in entries], np.uint16),
        )


def load_structure_table(path: Path) -> StructureTable:
    """Reads a structure table: CSV with columns `instance`, `name`, `class`.

    The columns `tags`, `reflectivity`, `material` and `kind` are optional, and
    their cells may be empty.

    Raises:
        InputError: the file lacks a column or a row is not usable.
    """
    entries: dict[str, StructureEntry] = {}
    instances: set[int] = set()
    for line, row in read_records(path, ("instance", "name", "class")):
        where = f"{path}: line {line}"
        name, semantic_class = row["name"], row["class"]
        instance = whole_number(row["instance"], f"{where}: instance")
        if not 1 <= instance <= MAX_INSTANCE or instance in instances:
            raise InputError(
                f"{where}: instance: {instance} is not a new number from "
                f"1 to {MAX_INSTANCE}"
            )
        if semantic_class not in CLASS_IDS:
            fault = no_such("class", semantic_class, CLASS_IDS)
            raise InputError(f"{where}: class: {fault}")
        if not name or name in entries:
            raise InputError(f"{where}: name: '{name}' is not a new name")
        instances.add(instance)
        try:
            materials = read_materials(row.get("material", ""))
        except ValueError as error:
            raise InputError(f"{where}: material: {error}") from None
        entries[name] = StructureEntry(
            instance,
            name,
            semantic_class,
            _reflectivity(row.get("reflectivity", ""), where),
            materials=materials,
            kind=row.get("kind", ""),
            tags=tuple(row.get("tags", "").split()),
        )
    return StructureTable(entries.values())


def _reflectivity(text: str, where: str) -> float | None:
    if not text:
        return None
    value = to_number(text)
    if not 0.0 <= value <= 1.0:
        raise InputError(
            f"{where}: reflectivity: {text!r} is not a number from 0 to 1"
        )
    return value


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
            raise ValueError(no_such("material", material, sorted(MATERIALS)))
        if part in found:
            raise ValueError(f"{word!r}: a second material")
        found[part] = material
    return found


def kind_in_name(name: str) -> str:
    """Returns the kind with which the name of a structure begins.

    Names are made of a kind and a number, such as `row_house_017` for the kind
    `row_house`. The name of an object that stands on the lot of a future
    building begins with the name of the building: `office_003_lot_02_bench`.
    """
    own = re.sub(r".*_lot_\d+_", "", name)
    # OpenStreetMap's numbers have the letter of node, way or relation.
    return re.sub(r"_[nwr]?-?\d.*", "", own)
