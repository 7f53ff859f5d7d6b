"""What the structure table must say about changes to a loaded world."""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace

from cns_drake.base.errors import InputError
from cns_drake.scene.labels import MAX_INSTANCE
from cns_drake.scene.structure_table import StructureEntry, StructureTable


class TableChanges:
    """New structures, changed parts and causes, for a structure table."""

    def __init__(self, table: StructureTable):
        """Begins without changes.

        Args:
            table: the structure table before the changes.
        """
        self._table = table
        # Name -> class and reflectivity of a new structure.
        self._added: dict[str, tuple[str, float | None]] = {}
        # Name of a structure -> new part of it -> material.
        self._materials: defaultdict[str, dict[str, str]] = defaultdict(dict)
        # Name of a structure -> part that was renamed -> its former name.
        self._renamed: defaultdict[str, dict[str, str]] = defaultdict(dict)
        self._causes: defaultdict[str, list[str]] = defaultdict(list)

    def add_structure(
        self,
        name: str,
        semantic_class: str,
        reflectivity: float | None = None,
        materials: Mapping[str, str] | None = None,
    ) -> None:
        """Records a new structure.

        Args:
            name: name of the structure, unique in the world.
            semantic_class: class of the structure.
            reflectivity: reflectivity of its surfaces, from 0 to 1; None if it
                follows from material and colour.
            materials: name of a part -> name of its material.
        """
        self._added[name] = semantic_class, reflectivity
        self._materials[name] |= materials or {}

    def set_material(self, structure: str, part: str, material: str) -> None:
        """Records the material of a new part."""
        self._materials[structure][part] = material

    def rename_part(self, structure: str, old: str, new: str) -> None:
        """Records that a part, which keeps its material, has another name."""
        self._renamed[structure][new] = old

    def add_cause(self, structure: str, cause: str) -> None:
        """Records why a structure was changed; each cause counts once."""
        if cause not in self._causes[structure]:
            self._causes[structure].append(cause)

    def changed_table(self) -> StructureTable:
        """Returns the table with the changes; new structures come last.

        Raises:
            InputError: there are more structures than instance ids.
        """
        first = self._table.last_instance + 1
        if first + len(self._added) - 1 > MAX_INSTANCE:
            raise InputError(
                f"transient: {len(self._added)} new structures and "
                f"{first - 1} others are more than instance ids can count "
                f"({MAX_INSTANCE})"
            )
        entries = [
            *self._table,
            *(
                StructureEntry(first + k, name, *self._added[name])
                for k, name in enumerate(sorted(self._added))
            ),
        ]
        return StructureTable(map(self._changed_entry, entries))

    def _changed_entry(self, entry: StructureEntry) -> StructureEntry:
        causes = [
            cause
            for cause in self._causes.get(entry.name, ())
            if cause not in entry.causes
        ]
        materials = dict(self._materials.get(entry.name, {}))
        known = {**entry.materials, **materials}
        for new, old in self._renamed.get(entry.name, {}).items():
            if old in known:
                materials[new] = known[old]
        if not (causes or materials):
            return entry
        return replace(
            entry,
            causes=(*entry.causes, *causes),
            materials={**entry.materials, **materials},
        )
