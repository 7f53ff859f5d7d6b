"""What the structure table must say about changes to a loaded world."""

from collections import defaultdict
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
        # Name -> entry of a new structure, still without an instance id.
        self._added: dict[str, StructureEntry] = {}
        # Name of a structure -> new part of it -> material.
        self._materials: defaultdict[str, dict[str, str]] = defaultdict(dict)
        # Name of a structure -> part that was renamed -> its former name.
        self._renamed: defaultdict[str, dict[str, str]] = defaultdict(dict)
        self._causes: defaultdict[str, list[str]] = defaultdict(list)

    def add_structure(self, entry: StructureEntry) -> None:
        """Records a new structure, which gets a free instance id.

        The name in its entry must be unique in the world.
        """
        self._added[entry.name] = entry

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
                replace(self._added[name], instance=first + k)
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
