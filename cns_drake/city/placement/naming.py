"""Stems of structure names."""

from __future__ import annotations

from cns_drake.city.placement.objects import OBJECTS
from cns_drake.city.plants.tree_species import SPECIES

# Objects of one class that share one word in everyday use.
_WORDS = {"car": "car", "truck": "truck", "traffic-sign": "sign"}


def name_stem(object_name: str) -> str:
    """Returns what an object is called, e.g. `tree` for a `lime_tree`."""
    if object_name in SPECIES:
        return "tree"
    return _WORDS.get(OBJECTS[object_name].semantic_class, object_name)
