"""Years in which the objects of a city were built and demolished.

Dates in files have the formats of OpenStreetMap:
https://wiki.openstreetmap.org/wiki/Key:start_date
"""

from collections.abc import Mapping
import datetime
from datetime import date
import re
from typing import Any

from worlds.imports.faults import ImportFaults

# Word before a period, or none -> the share of the period after which a year
# with this word lies.
_SHARES_OF_PERIOD = {"early": 0.2, "mid": 0.5, "late": 0.8, "": 0.5}
_ABOUT = re.compile(r"^(?:~|ca\.?|circa|about|before|after|by|j:)\s*")
_PERIOD = re.compile(
    r"(?:(early|mid|late)[\s-]*)?(?:c(\d{1,2})|(\d{1,3})0s)", re.ASCII
)
_DAY = re.compile(r"jd:(\d{7})(?:\.\d+)?", re.ASCII)
# A year, a month, a day or a time, as in ISO 8601; the year may be negative.
_DATE = re.compile(
    r"(-?\d{4}|\d{1,3})(?:-(?:0?[1-9]|1[0-2])(?:-(?:0?[1-9]|[12]\d|3[01])"
    r"(?:t[\d:.]+)?(?:z|[+-]\d\d:?\d\d)?)?)?",
    re.ASCII,
)
# Day, month and year, as some registers write them.
_DAY_FIRST = re.compile(r"\d{1,2}\.\d{1,2}\.(\d{4})", re.ASCII)
_BEFORE_CHRIST = re.compile(r"(\d{1,4})\s*(?:bce?|b\.c\.)", re.ASCII)
# Longer texts are cut [characters].
_LONGEST_TEXT = 255
# Julian day number of the day before 1 January of the year 1.
_DAY_ZERO = 1721425
# The usual attributes in lower case, the most reliable first: those of 3DBAG,
# CityGML, predecessors of 3DBAG, and OpenStreetMap.
_USUAL_ATTRIBUTES = (
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
# Attributes with the year of demolition, in lower case.
_DEMOLITION_ATTRIBUTES = (
    "yearofdemolition",
    "year_of_demolition",
    "dateofdemolition",
    "demolitionyear",
    "end_date",
)
# Greatest year in a file that is a year and no other number; it is also a
# placeholder for an unknown year.
_PLACEHOLDER = 9999
# Placeholder for an unknown year in Dutch registers.
_DUTCH_PLACEHOLDER = 1005
# Names of the year of construction in Dutch registers.
_DUTCH_ATTRIBUTES = ("oorspronkelijkbouwjaar", "bouwjaar")


def year_of_date(text: str) -> int | None:
    """Returns the year that a text states; None if it is not understood.

    The whole text must have one of the documented forms. Years before Christ
    are negative: 0 is the year 1 BC. For a range (`1914..1918`), the result is
    the last year; for `before 1910` and `~1855`, the year in the text. For a
    period such as a century, the result is the middle year, or an earlier or
    later year if the text says "early" or "late".
    """
    text = text.strip().lower()[:_LONGEST_TEXT].split("..")[-1].strip()
    day = _DAY.fullmatch(text)
    if day:
        number = int(day[1]) - _DAY_ZERO
        is_day = 1 <= number <= date.max.toordinal()
        return date.fromordinal(number).year if is_day else None
    while (plain := _ABOUT.sub("", text)) != text:
        text = plain
    period = _PERIOD.fullmatch(text)
    if period:
        share = _SHARES_OF_PERIOD[period[1] or ""]
        if period[2]:
            century = int(period[2])
            return 100 * (century - 1) + round(100 * share) if century else None
        return 10 * int(period[3]) + round(10 * share)
    if found := _BEFORE_CHRIST.fullmatch(text):
        return 1 - int(found[1]) if int(found[1]) else None
    match = _DATE.fullmatch(text) or _DAY_FIRST.fullmatch(text)
    # A year of 0 is a placeholder for an unknown year.
    return (int(match[1]) or None) if match else None


def demolition_year(
    attributes: Mapping[str, Any], name: str, faults: ImportFaults
) -> int | None:
    """Returns the year in which an object was demolished; None if unknown.

    The arguments are as for `construction_year`.
    """
    lower = {key.lower(): value for key, value in attributes.items()}
    for key in _DEMOLITION_ATTRIBUTES:
        year = understood_year(lower.get(key), key, name, faults)
        if year not in (None, _PLACEHOLDER):
            return year
    return None


def construction_year(
    attributes: Mapping[str, Any],
    attribute: str | None,
    name: str,
    faults: ImportFaults,
) -> int | None:
    """Returns the year in which an object was built; None if unknown.

    Args:
        attributes: attributes of the object, as in its file.
        attribute: name of the attribute with the year; if None, the usual
            attributes are tried.
        name: name of the object, as an example in `faults`.
        faults: counts placeholders for unknown years, and years in the future.
    """
    if attribute is not None:
        candidates = {attribute: attributes.get(attribute)}
    else:
        lower = {key.lower(): value for key, value in attributes.items()}
        candidates = {
            key: lower[key] for key in _USUAL_ATTRIBUTES if key in lower
        }
    for key, value in candidates.items():
        year = understood_year(value, key, name, faults)
        if year is None:
            continue
        is_dutch = key.lower() in _DUTCH_ATTRIBUTES
        if year == _PLACEHOLDER or (is_dutch and year == _DUTCH_PLACEHOLDER):
            faults.add(f"{year} in place of a year, taken as no year", name)
            continue
        if year > datetime.date.today().year:
            faults.add("year after today", name)
        return year
    return None


def understood_year(
    value: object, key: str, name: str, faults: ImportFaults
) -> int | None:
    """Returns the year in an attribute, a number or a text; None if none.

    A value that is not understood is counted in `faults`.
    """
    if isinstance(value, bool) or value is None or value == "":
        return None
    if isinstance(value, (int, float)):
        year = int(value) if 1 <= value <= _PLACEHOLDER else None
    else:
        year = year_of_date(str(value))
    # 0 and the like stand for unknown years.
    if year is None and str(value).strip(" 0."):
        faults.add(f"date in {key} that is not understood", name)
    return year


def stands_today(until: int | None) -> bool:
    """Returns whether an object stands today, given its year of demolition.

    The object stands if the year `until` is in the future, or None (never
    demolished).
    """
    return until is None or until > datetime.date.today().year
