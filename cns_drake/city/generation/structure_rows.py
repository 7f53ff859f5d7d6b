"""The table of a city's structures, by instance id."""

from __future__ import annotations

from collections.abc import Iterable
import csv
import io

from cns_drake.city.geometry.structures import Structure
from cns_drake.scene.semantics import CLASS_IDS

# Instance ids are stored as uint16; 0 means no structure.
MAX_STRUCTURES = 2**16 - 1


def structure_table(structures: Iterable[Structure]) -> str:
    """Returns the CSV that maps instance ids to names and classes."""
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(
        ["instance", "name", "class", "label", "x", "y", "z", "yaw", "tags"]
    )
    for instance, structure in enumerate(structures, start=1):
        table.writerow(
            [
                instance,
                structure.name,
                structure.semantic_class,
                CLASS_IDS[structure.semantic_class],
                *(f"{value:.3f}" for value in structure.xyz),
                f"{structure.yaw:.5f}",
                " ".join(structure.tags),
            ]
        )
    return out.getvalue()
