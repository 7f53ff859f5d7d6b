"""The options of an import."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

# The first stage in which buildings without a year stand.
Undated = Literal["first", "last", "never"]
# The side of a street on which traffic keeps.
DriveOn = Literal["right", "left"]


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
        lod: level of detail to read; None for each object's highest level.
        seed: seed of everything that is sampled at random: the changes of
            `grow`, the details of `dressed`, and the buildings of a town that
            is built along a file's roads.
        along: CSV file with the waypoints of a drive. This drive replaces the
            two proposed drives; None for the proposed drives.
        within: greatest distance of structures from the drives [m]; None for no
            limit.
        drive_on: side of the street on which traffic keeps; None for the side
            in the file, or right if the file names none.
        grow: share of the buildings, sampled at random, that are missing in an
            additional first stage or lower there than today; None for no such
            stage.
        dressed: whether to add details, such as windows and parked cars, that
            are not in the file.

    Example:
        from worlds import ImportOptions

        options = ImportOptions(years=(1980, 2020), dressed=True)
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
