"""Stems of structure names."""

from __future__ import annotations

from cns_drake.city.placement.objects import OBJECTS
from cns_drake.city.plants.tree_species import SPECIES

# Several objects of one class that a reader would call by one word.
_WORDS = {"car": "car", "truck": "truck", "traffic-sign": "sign"}


def name_stem(object_name: str) -> str:
    """Returns what an object is called, e.g. `tree` for a `lime_tree`."""
    if object_name in SPECIES:
        return "tree"
    return _WORDS.get(OBJECTS[object_name].semantic_class, object_name)
