"""What is taken of a file, and what came of it."""

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
    """What is taken of a file.

    Attributes:
        years: of the stages, increasing; one stage of all if there is none.
        year_attribute: that tells when something was built; one of the usual
            ones if None.
        undated: what becomes of buildings without a year.
        lod: level of detail; the highest of each object if None.
        seed: of what is drawn: by `grow`, and where a file of roads has no
            buildings.
        along: waypoints of a drive, in place of two that are proposed.
        grow: part of the buildings that a stage before the only one lacks, or
            has lower, by lot; no such stage if None.
        drive_on: side of the streets; that which the file tells, or the
            right, if None.
        within: how far from the drives a structure may lie; anywhere if None
            [m].
        dressed: whether what the file does not say of the looks of buildings
            is drawn by lot.
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
    """What came of a file.

    Attributes:
        kinds: type of object -> how many structures.
        triangles: of all.
        stages: stage -> how many structures stand.
        undated, dated: buildings without a year, and with one.
        drives: lengths of the proposed drives [m].
        faults: kind, how many, example.
    """

    kinds: dict[str, int]
    triangles: int
    stages: dict[str, int]
    undated: int
    dated: int
    drives: tuple[float, ...]
    faults: list[tuple[str, int, str]]
