"""Options of an import, and its result."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from cns_drake.imports.building_years import Undated


class DriveOn(str, Enum):
    """The side of a street on which cars drive."""

    RIGHT = "right"
    LEFT = "left"


@dataclass(frozen=True)
class ImportOptions:
    """The options of an import.

    Attributes:
        years: of the stages, increasing; without any there is one stage.
        year_attribute: the attribute with the year of construction; the usual
            ones if None.
        undated: the first stage of buildings without a year.
        lod: level of detail; the highest of each object if None.
        seed: of the draws of `grow`, and of buildings along a file's roads.
        along: waypoints of a drive, in place of the two proposed ones.
        grow: share of the buildings that an added first stage lacks, or has
            lower, at random; no such stage if None.
        drive_on: side of the streets; if None, the file's, or else the right.
        within: greatest distance of structures from the drives [m]; no limit if
            None.
        dressed: whether looks that the file leaves open are drawn at random.
    """

    years: tuple[int, ...] = ()
    year_attribute: str | None = None
    undated: Undated = Undated.FIRST
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
        triangles: of all.
        stages: stage -> number of structures.
        undated, dated: buildings without a year, and with one.
        drives: lengths of the proposed drives [m].
        faults: kind, number, example.
    """

    kinds: dict[str, int]
    triangles: int
    stages: dict[str, int]
    undated: int
    dated: int
    drives: tuple[float, ...]
    faults: list[tuple[str, int, str]]
