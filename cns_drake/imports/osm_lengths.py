"""Numbers in the tags of OpenStreetMap.

https://wiki.openstreetmap.org/wiki/Map_features/Units,
https://wiki.openstreetmap.org/wiki/Key:building:levels
"""

from __future__ import annotations

from collections.abc import Iterator
import re

# Units in metres; without one a length is in metres.
_UNITS = {
    "": 1.0,
    "m": 1.0,
    "metre": 1.0,
    "metres": 1.0,
    "meter": 1.0,
    "meters": 1.0,
    "cm": 0.01,
    "km": 1000.0,
    "mi": 1609.344,
    "ft": 0.3048,
    "foot": 0.3048,
    "feet": 0.3048,
    "'": 0.3048,
    "in": 0.0254,
    '"': 0.0254,
}
_NUMBER = r"(\d+(?:[.,]\d+)?|[.,]\d+)"
_LENGTH = re.compile(rf"{_NUMBER}\s*([a-z]*|'|\")")
_FEET_AND_INCHES = re.compile(
    rf"{_NUMBER}\s*(?:'|ft|feet|foot)\s*{_NUMBER}\s*(?:\"|in|'')?"
)
# Separators of lists and of ranges.
_BETWEEN = re.compile(r"\s*;\s*|(?<=[^\s;])\s*(?:-|–|\bto\b)\s*(?=[\d.,])")
_ABOUT = re.compile(r"^\s*(?:~|≈|ca\.?|about|approx\.?)\s*")
_QUOTES = str.maketrans({"’": "'", "′": "'", "”": '"', "″": '"'})


def length(text: str | None) -> float | None:
    """Returns a length in metres; None if it is missing or no length.

    The greatest, where there is a list or a range.
    """
    found = [_length(part) for part in _parts(text)]
    return _greatest(found)


def count(text: str | None) -> float | None:
    """Returns a number, such as of levels; None if it is missing or none.

    The greatest, where there is a list or a range.
    """
    found = [
        float(part.replace(",", ".")) if re.fullmatch(_NUMBER, part) else None
        for part in _parts(text)
    ]
    return _greatest(found)


def _parts(text: str | None) -> Iterator[str]:
    if text is None or len(text) > 255:  # OpenStreetMap allows no more.
        return
    plain = _ABOUT.sub("", text.translate(_QUOTES).lower())
    for part in _BETWEEN.split(plain):
        if part.strip():
            yield _ABOUT.sub("", part).strip()


def _length(text: str) -> float | None:
    both = _FEET_AND_INCHES.fullmatch(text)
    if both:
        feet, inches = (float(one.replace(",", ".")) for one in both.groups())
        return 0.3048 * (feet + inches / 12.0)
    match = _LENGTH.fullmatch(text)
    if match is None or match[2] not in _UNITS:
        return None
    return float(match[1].replace(",", ".")) * _UNITS[match[2]]


def _greatest(values: list[float | None]) -> float | None:
    """Returns the greatest value; None without any, or if one is None."""
    if not values or None in values:
        return None
    return max(value for value in values if value is not None)
