"""Years of construction of a city's objects, and stages made from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import datetime
from enum import Enum
from itertools import pairwise
from typing import Any

from cns_drake.base.errors import InputError
from cns_drake.imports.date_years import year_of_date
from cns_drake.imports.import_faults import ImportFaults

# The usual attributes, small letters, most reliable first: 3DBAG, CityGML, 3D
# BAG's forerunners, OpenStreetMap.
_USUAL = (
    "oorspronkelijkbouwjaar",
    "yearofconstruction",
    "year_of_construction",
    "dateofconstruction",
    "constructionyear",
    "construction_year",
    "yearbuilt",
    "year_built",
    "bouwjaar",
    "baujahr",
    "start_date",
)
# Placeholders for an unknown year; the second one in Dutch registers only.
_PLACEHOLDER = 9999
_DUTCH_PLACEHOLDER = 1005
_DUTCH = ("oorspronkelijkbouwjaar", "bouwjaar")


class Undated(str, Enum):
    """The first stage that has the buildings without a year."""

    FIRST = "first"
    LAST = "last"
    NEVER = "never"


def construction_year(
    attributes: Mapping[str, Any],
    attribute: str | None,
    name: str = "",
    faults: ImportFaults | None = None,
) -> int | None:
    """Returns the year in which an object was built, if the file has it.

    Args:
        attributes: of the object.
        attribute: the attribute that holds the year; the usual ones if None.
        name: of the object.
        faults: counts values that are not years, and years to come.
    """
    faults = faults or ImportFaults()
    if attribute is not None:
        given = {attribute: attributes.get(attribute)}
    else:
        lower = {key.lower(): value for key, value in attributes.items()}
        given = {key: lower[key] for key in _USUAL if key in lower}
    for key, value in given.items():
        year = _year(value)
        if year is None:
            continue
        is_dutch = key.lower() in _DUTCH
        if year == _PLACEHOLDER or (is_dutch and year == _DUTCH_PLACEHOLDER):
            faults.add(f"{year} in place of a year, taken as no year", name)
            continue
        if year > datetime.date.today().year:
            faults.add("year after today", name)
        return year
    return None


def _year(value: object) -> int | None:
    if isinstance(value, bool) or value is None:
        return None
    if isinstance(value, (int, float)):
        return int(value) if 1 <= value <= 9999 else None
    return year_of_date(str(value))


def stage_names(years: Sequence[int]) -> list[str]:
    """Returns the name of each stage, from 01 on; one without years.

    Raises:
        InputError: if years do not increase.
    """
    if any(a >= b for a, b in pairwise(years)):
        listed = " ".join(map(str, years))
        raise InputError(
            f"--years: {listed}: each year must be after the one before"
        )
    return [f"{number:02d}" for number in range(1, max(len(years), 1) + 1)]


def stands_today(until: int | None) -> bool:
    """Returns whether an object stands, by the year of its demolition."""
    return until is None or until > datetime.date.today().year


def stands_at(
    year: int | None,
    until: int | None,
    stage: int,
    years: Sequence[int],
    undated: Undated,
) -> bool:
    """Returns whether an object stands at a stage.

    Args:
        year: year in which it was built; None if unknown.
        until: year in which it was demolished, if it was.
        stage: number of the stage, from 0 on.
        years: of the stages; without any, everything of today stands.
        undated: the stage of objects without a year.
    """
    if not years:
        return stands_today(until)
    if until is not None and years[stage] >= until:
        return False
    if year is not None:
        return year <= years[stage]
    if undated is Undated.FIRST:
        return True
    return undated is Undated.LAST and stage == len(years) - 1
