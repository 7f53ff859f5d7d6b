"""Counts of the faults that an import finds in a file."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from evaluation.base import InputError

# Longer texts are cut [characters].
_LONGEST_TEXT = 100
# The example of a fault that concerns all of a file.
WHOLE_FILE = "the file"
# A file is refused if the shapes of a greater share of it cannot be read.
_MOST_RUINED = 0.5
# Use of a part -> how a report calls it.
_USES = {"read": "read", "shapeless": "ignored, changes no shape"}


class FaultCount(NamedTuple):
    """How often an import found a kind of fault.

    Attributes:
        kind: the fault and its remedy, in words.
        number: number of faults.
        example: name of one object that has the fault.
    """

    kind: str
    number: int
    example: str


class Share(NamedTuple):
    """Which share of the world a kind of fault concerns.

    Attributes:
        part: the share, from 0 to 1.
        of: the whole, in words.
    """

    part: float
    of: str

    @property
    def percent(self) -> str:
        """The share with two digits, such as `1.7 %`."""
        return f"{float(f'{100 * self.part:.2g}'):g} %"

    def __str__(self) -> str:
        return f"{self.percent} of {self.of}"


class ImportFaults:
    """Counts the repaired and omitted parts of a file, by kind of fault.

    For each kind, the name of one object is kept as an example.
    """

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._examples: dict[str, str] = {}
        self._names: dict[str, set[str]] = {}
        self._ruins: set[str] = set()
        self._parts: dict[tuple[str, str], set[str]] = {}

    def add(
        self, kind: str, example: str, number: int = 1, *, ruins: bool = False
    ) -> None:
        """Adds `number` faults of one kind to the counts.

        Args:
            kind: the fault and its remedy, in words.
            example: name of an object that has the fault.
            number: number of faults.
            ruins: whether the object's shape in the file cannot be read.
        """
        kind = _printable(kind)
        if ruins:
            self._ruins.add(kind)
        self._counts[kind] += number
        self._examples.setdefault(kind, _printable(example))
        self._names.setdefault(kind, set()).add(example)

    def take_back(self, kind: str) -> None:
        """Removes one fault of a kind from the counts.

        Use this function for a counted fault that turns out not to matter, such
        as an object that was left out at first and is placed later.
        """
        kind = _printable(kind)
        self._counts[kind] -= 1
        if not self._counts[kind]:
            del self._counts[kind], self._examples[kind]

    def note_part(self, element: str, use: str, part: str) -> None:
        """Notes that objects have a part that is no fault.

        Args:
            element: kind of the objects, such as `street`.
            use: what becomes of the part: `read` or `shapeless`.
            part: name of the part, such as a tag's key.
        """
        self._parts.setdefault((element, use), set()).add(_printable(part))

    def parts(self) -> list[str]:
        """Returns a line for each kind of object and each use of its parts."""
        return [
            f"{element}: {_USES[use]}: {' '.join(sorted(names))}"
            for (element, use), names in sorted(self._parts.items())
        ]

    def shares(
        self, volumes: Mapping[str, float], num_elements: int
    ) -> dict[str, Share]:
        """Returns which share of the world each kind of fault concerns.

        Args:
            volumes: name of a building -> its volume [m^3].
            num_elements: number of elements of the file, for faults that no
                building has.
        """
        whole = sum(volumes.values()) or 1.0
        shares = {}
        for kind in self._counts:
            names = self._names[kind]
            volume = sum(volumes.get(name, 0.0) for name in names)
            number = num_elements if WHOLE_FILE in names else len(names)
            elements = min(number / max(num_elements, 1), 1.0)
            shares[kind] = (
                Share(volume / whole, "the volume of all buildings")
                if volume
                else Share(elements, "the elements of the file")
            )
        return shares

    def check_ruins(self, source: object, built: Iterable[str]) -> None:
        """Checks that at least half of the objects have their shapes.

        Args:
            source: the file, named in the error.
            built: names of the objects in the city.

        Raises:
            InputError: the shapes of more objects cannot be read.
        """
        ruined = set().union(*(self._names[kind] for kind in self._ruins))
        whole = ruined.union(built)
        share = Share(
            len(ruined) / max(len(whole), 1), "what should be in the city"
        )
        if share.part > _MOST_RUINED:
            why = "; ".join(
                f"{one.kind}: {one.number}, such as {one.example}"
                for one in self.rows()
                if one.kind in self._ruins
            )
            raise InputError(f"{source}: {share} cannot be read: {why}")

    def rows(self) -> list[FaultCount]:
        """Returns the counts of all kinds of faults, most frequent first."""
        return [
            FaultCount(kind, number, self._examples[kind])
            for kind, number in sorted(
                self._counts.items(), key=lambda item: (-item[1], item[0])
            )
        ]


def _printable(text: str) -> str:
    """Returns a text without control characters, cut to 100 characters."""
    shown = "".join(c if c.isprintable() else " " for c in text)
    if len(shown) <= _LONGEST_TEXT:
        return shown
    return f"{shown[: _LONGEST_TEXT - 3]}..."
