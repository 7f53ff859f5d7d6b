"""The options of an import, the faults that it counts, and its report."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

# The first stage in which buildings without a year stand.
Undated = Literal["first", "last", "never"]
# The side of a street on which traffic keeps.
DriveOn = Literal["right", "left"]
# File in the map's folder that lists all counts of an import.
REPORT_NAME = "import.txt"
_LONGEST = 100


class ImportFaults:
    """Counts the repaired and omitted parts of a file, by kind of fault.

    For each kind, the name of one object is kept as an example.
    """

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._examples: dict[str, str] = {}

    def add(self, kind: str, example: str, number: int = 1) -> None:
        """Adds `number` faults of one kind to the counts.

        `kind` describes the fault and its remedy in words. `example` is the
        name of an object that has the fault.
        """
        kind = _printable(kind)
        self._counts[kind] += number
        self._examples.setdefault(kind, _printable(example))

    def take_back(self, kind: str) -> None:
        """Removes one fault of a kind from the counts.

        Use this function for a counted fault that turns out not to matter, such
        as an object that was left out at first and is placed later.
        """
        kind = _printable(kind)
        self._counts[kind] -= 1
        if not self._counts[kind]:
            del self._counts[kind], self._examples[kind]

    def rows(self) -> list[tuple[str, int, str]]:
        """Returns kind, count and example of faults, most frequent first."""
        return [
            (kind, number, self._examples[kind])
            for kind, number in sorted(
                self._counts.items(), key=lambda item: (-item[1], item[0])
            )
        ]


def _printable(text: str) -> str:
    """Returns a text without its control characters."""
    shown = "".join(c if c.isprintable() else " " for c in text)
    return shown if len(shown) <= _LONGEST else f"{shown[: _LONGEST - 3]}..."


@dataclass(frozen=True)
class ImportOptions:
    """The options of an import.

    Attributes:
        years: years of the stages, increasing. Without years there is one
            stage: today.
        year_attribute: attribute with the year of construction; None for the
            usual attributes.
        undated: which stages contain the buildings whose year is unknown: all
            stages (`first`), only the last stage (`last`), or none (`never`).
        lod: level of detail to read; None for the highest of each object.
        seed: seed of everything that is sampled at random: the changes of
            `grow`, the details of `dressed`, and the buildings of a town that
            is built along a file's roads.
        along: CSV file with the waypoints of a drive, which replaces the two
            proposed drives; None for the proposed drives.
        within: greatest distance of structures from the drives [m]; None for no
            limit.
        drive_on: side of the street on which traffic keeps; None for the side
            in the file, or right if the file names none.
        grow: share of the buildings, sampled at random, that are missing in an
            additional first stage or lower there than today; None for no such
            stage.
        dressed: whether to add details, such as windows and parked cars, that
            are not in the file.
    """

    years: tuple[int, ...] = ()
    year_attribute: str | None = None
    undated: Undated = "first"
    lod: float | None = None
    seed: int = 0
    along: Path | None = None
    within: float | None = None
    drive_on: DriveOn | None = None
    grow: float | None = None
    dressed: bool = False


@dataclass(frozen=True)
class ImportReport:
    """The result of an import.

    Attributes:
        kinds: type of object -> number of structures.
        triangles: number of triangles.
        stages: name of a stage -> number of its structures.
        undated: number of buildings without a year.
        dated: number of buildings with a year.
        drives: lengths of the proposed drives [m].
        faults: kind, count and example of each fault.
    """

    kinds: dict[str, int]
    triangles: int
    stages: dict[str, int]
    undated: int
    dated: int
    drives: tuple[float, ...]
    faults: list[tuple[str, int, str]]
