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
    """Counts of repaired and omitted parts of a file, by kind of fault.

    Each kind has the name of one object as an example.
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
        """Reduces the count of a kind of fault by one."""
        kind = _printable(kind)
        self._counts[kind] -= 1
        if not self._counts[kind]:
            del self._counts[kind], self._examples[kind]

    def rows(self) -> list[tuple[str, int, str]]:
        """Returns kind, number and example of faults, most frequent first."""
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
        undated: first stage with the buildings whose year is unknown: `first`,
            `last` or `never`.
        lod: level of detail to read; None for the highest of each object.
        seed: seed of the random draws of `grow`, and of buildings along a
            file's roads.
        along: file with the waypoints of a drive that replaces the two proposed
            drives.
        within: greatest distance of structures from the drives [m]; no limit if
            None.
        drive_on: side of the street on which traffic keeps; if None, the side
            in the file, or right if it has none.
        grow: share of the buildings that are missing or lower in an additional
            first stage, drawn at random; no such stage if None.
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
        stages: stage -> number of structures.
        undated, dated: numbers of buildings without a year, and with one.
        drives: lengths of the proposed drives [m].
        faults: kind, number and example of faults.
    """

    kinds: dict[str, int]
    triangles: int
    stages: dict[str, int]
    undated: int
    dated: int
    drives: tuple[float, ...]
    faults: list[tuple[str, int, str]]
