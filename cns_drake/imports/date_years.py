"""Years in the dates of OpenStreetMap and city models.

https://wiki.openstreetmap.org/wiki/Key:start_date
"""

from __future__ import annotations

from datetime import date
import re

# Position in a period of "early", "mid", "late" and of no such word.
_PARTS = {"early": 0.2, "mid": 0.5, "late": 0.8, "": 0.5}
_ABOUT = re.compile(r"^(?:~|ca\.?|circa|about|before|after|by|j:)\s*")
_PERIOD = re.compile(
    r"(?:(early|mid|late)[\s-]*)?(?:c(\d{1,2})|(\d{3})0s)", re.ASCII
)
_DAY = re.compile(r"jd:(\d{7})(?:\.\d+)?", re.ASCII)
_YEAR = re.compile(r"(?<!\d)(\d{3,4})(?!\d)", re.ASCII)
# The Julian day of the day before 1 January of the year 1.
_DAY_ZERO = 1721425


def year_of_date(text: str) -> int | None:
    """Returns the year of a date, None if it has none.

    A period gives its middle, or an earlier or later year with "early" and
    "late". A range (`1914..1918`) gives its end; `before 1910` and `~1855` give
    the year they name.
    """
    text = text.strip().lower()[:255].split("..")[-1].strip()
    day = _DAY.fullmatch(text)
    if day:
        number = int(day[1]) - _DAY_ZERO
        is_day = 1 <= number <= date.max.toordinal()
        return date.fromordinal(number).year if is_day else None
    while (plain := _ABOUT.sub("", text)) != text:
        text = plain
    period = _PERIOD.fullmatch(text)
    if period:
        part = _PARTS[period[1] or ""]
        if period[2]:
            century = int(period[2])
            return 100 * (century - 1) + round(100 * part) if century else None
        return 10 * int(period[3]) + round(10 * part)
    match = _YEAR.search(text)
    return (int(match[1]) or None) if match else None
