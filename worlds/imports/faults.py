"""Counts of the faults that an import finds in a file."""

from collections import Counter
from collections.abc import Mapping
from typing import NamedTuple

# Longer texts are cut [characters].
_LONGEST_TEXT = 100
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


class ImportFaults:
    """Counts the repaired and omitted parts of a file, by kind of fault.

    For each kind, the name of one object is kept as an example.
    """

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._examples: dict[str, str] = {}
        self._names: dict[str, set[str]] = {}
        self._parts: dict[tuple[str, str], set[str]] = {}

    def add(self, kind: str, example: str, number: int = 1) -> None:
        """Adds `number` faults of one kind to the counts.

        `kind` describes the fault and its remedy in words. `example` is the
        name of an object that has the fault.
        """
        kind = _printable(kind)
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

    def shares(self, volumes: Mapping[str, float]) -> dict[str, float]:
        """Returns the share of the whole volume that has each kind of fault.

        Args:
            volumes: name of an object -> its volume [m^3].

        Returns:
            Kind -> share, from 0 to 1; only kinds of these objects.
        """
        whole = sum(volumes.values()) or 1.0
        shares = {
            kind: sum(volumes.get(name, 0.0) for name in names) / whole
            for kind, names in self._names.items()
            if kind in self._counts
        }
        return {kind: share for kind, share in shares.items() if share > 0.0}

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
