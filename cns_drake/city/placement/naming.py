"""Names of structures: a word for the kind (the stem), and a number."""

from collections import Counter

from cns_drake.city.placement.objects import OBJECTS
from cns_drake.city.plants.trees import SPECIES

# Semantic class -> the everyday word for its objects, as the stem of their
# names.
_WORDS = {"car": "car", "truck": "truck", "traffic-sign": "sign"}
# Ranges of numbers in names begin at multiples of this.
_RANGE = 50


def name_stem(object_kind: str) -> str:
    """Returns the everyday word for an object, with which its name begins.

    For example, the word for `lime_tree` is `tree`. `object_kind` is a key of
    `cns_drake.city.placement.objects.OBJECTS`.
    """
    if object_kind in SPECIES:
        return "tree"
    return _WORDS.get(OBJECTS[object_kind].semantic_class, object_kind)


class NameCounter:
    """Numbers the names of structures, separately for each stem."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()

    def next_name(self, stem: str) -> str:
        """Returns a new name, e.g. `tower_017` for the stem `tower`."""
        self._counts[stem] += 1
        return f"{stem}_{self._counts[stem]:03d}"

    def open_range(self) -> None:
        """Makes the numbers in new names begin after the next multiple of 50.

        Call this function before each task, such as placing a row of trees. If
        a task then places a few structures more or fewer, the names of
        structures in later tasks stay the same. `stages.yaml` refers to such
        names.
        """
        for stem, count in self._counts.items():
            self._counts[stem] = -(-count // _RANGE) * _RANGE
