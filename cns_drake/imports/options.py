"""Options of an import, the faults that it counts, and its report."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

# The first stage that has the buildings without a year.
Undated = Literal["first", "last", "never"]
# The side of a street on which cars drive.
DriveOn = Literal["right", "left"]
# Lists all counts of an import, in the folder of the map.
REPORT_NAME = "import.txt"
_LONGEST = 100


class ImportFaults:
    """Counts of repaired and omitted parts, with one example of each kind."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._examples: dict[str, str] = {}

    def add(self, kind: str, example: str, number: int = 1) -> None:
        """Counts faults of a kind: the fault and its remedy, in words.

        The example is the name of an object that has it.
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
        """Returns kind, number and example, most frequent first."""
        return [
            (kind, number, self._examples[kind])
            for kind, number in sorted(
                self._counts.items(), key=lambda item: (-item[1], item[0])
            )
        ]


def _printable(text: str) -> str:
    """Returns a text of a file without control characters."""
    shown = "".join(c if c.isprintable() else " " for c in text)
    return shown if len(shown) <= _LONGEST else f"{shown[: _LONGEST - 3]}..."


@dataclass(frozen=True)
class ImportOptions:
    """The options of an import.

    Attributes:
        years: years of the stages, increasing; without any there is one stage.
        year_attribute: attribute with the year of construction; if None, the
            usual attributes.
        undated: first stage in which buildings without a year stand.
        lod: level of detail; if None, the highest of each object.
        seed: seed of the draws of `grow`, and of buildings along a file's
            roads.
        along: waypoints of a drive, in place of the two proposed ones.
        grow: share of the buildings that, drawn at random, are missing or lower
            in an additional first stage; no such stage if None.
        drive_on: side of the street on which traffic keeps; if None, the side
            that the file gives, or else the right.
        within: greatest distance of structures from the drives [m]; no limit if
            None.
        dressed: whether looks that the file leaves open are drawn at random.
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

    Numbers of structures by type of object and by stage, of triangles, and of
    buildings without a year and with one; lengths of the proposed drives [m];
    kind, number and example of faults.
    """

    kinds: dict[str, int]
    triangles: int
    stages: dict[str, int]
    undated: int
    dated: int
    drives: tuple[float, ...]
    faults: list[tuple[str, int, str]]
