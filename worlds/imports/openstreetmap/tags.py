"""Values of OpenStreetMap's tags, in SI units.

https://wiki.openstreetmap.org/wiki/Map_features,
https://wiki.openstreetmap.org/wiki/Map_features/Units
"""

from collections.abc import Callable, Mapping
from pathlib import Path
import re

from evaluation.base import parse_yaml
from worlds.imports.faults import ImportFaults

TABLES = parse_yaml(Path(__file__).with_name("tags.yaml").read_bytes())
# Smaller sizes and numbers are 0 in words, which no thing has.
LEAST = 0.01
# OpenStreetMap allows no longer values of tags [characters].
_LONGEST_VALUE = 255
# Tags without which a thing has not the size that it has in the file.
_SIZES = ("height", "building:height", "building:levels", "width", "diameter")
_FOOT = 0.3048  # [m]
_NUMBER = r"(\d+(?:[.,]\d+)?|[.,]\d+)"
_LENGTH = re.compile(rf"{_NUMBER}\s*([a-z]*|'|\")")
_COUNT = re.compile(_NUMBER)
_FEET_AND_INCHES = re.compile(
    rf"{_NUMBER}\s*(?:'|ft|feet|foot)\s*{_NUMBER}\s*(?:\"|in|'')?"
)
# Separators in lists and in ranges.
_BETWEEN = re.compile(r"\s*;\s*|(?<=[^\s;])\s*(?:-|–|\bto\b)\s*(?=[\d.,])")
_ABOUT = re.compile(r"^\s*(?:~|≈|ca\.?|about|approx\.?)\s*")
# Names of directions, clockwise from north.
_COMPASS = (
    "n", "nne", "ne", "ene", "e", "ese", "se", "sse",
    "s", "ssw", "sw", "wsw", "w", "wnw", "nw", "nnw",
)  # fmt: skip
_QUOTES = str.maketrans({"’": "'", "′": "'", "”": '"', "″": '"'})


def length(text: str | None) -> float | None:
    """Returns the length [m] that a text states, or None.

    If the text contains a list or a range, the greatest length is returned.
    """
    return _greatest_value(text, _parsed_length)


def count(text: str | None) -> float | None:
    """Returns the number that a text states, such as a number of levels.

    If the text contains a list or a range, the greatest number is returned. The
    result is None if the text states no number.
    """
    return _greatest_value(
        text, lambda part: _decimal(part) if _COUNT.fullmatch(part) else None
    )


def heading_deg(text: str | None) -> float | None:
    """Returns the direction that a text states, such as `NW` or `315`, or None.

    The text counts clockwise from north; the result, from -270 to 90, counts
    counter-clockwise from east [deg].
    """
    name = (text or "").lower()
    if name in _COMPASS:
        return 90.0 - 360.0 / len(_COMPASS) * _COMPASS.index(name)
    number = _decimal(name) if _COUNT.fullmatch(name) else 361.0
    return 90.0 - number if number <= 360.0 else None


def _greatest_value(
    text: str | None, read: Callable[[str], float | None]
) -> float | None:
    """Returns the greatest value in a text; None if a value is unreadable.

    `read` converts the text of one value, and returns None if it cannot.
    """
    if text is None or len(text) > _LONGEST_VALUE:
        return None
    plain = _ABOUT.sub("", text.translate(_QUOTES).lower())
    parts = [part for part in _BETWEEN.split(plain) if part.strip()]
    values = [read(_ABOUT.sub("", part).strip()) for part in parts]
    known = [value for value in values if value is not None]
    return max(known) if known and len(known) == len(values) else None


def _parsed_length(text: str) -> float | None:
    """Returns one length, in feet and inches or with a unit [m]."""
    feet_and_inches = _FEET_AND_INCHES.fullmatch(text)
    if feet_and_inches:
        feet, inches = map(_decimal, feet_and_inches.groups())
        return _FOOT * (feet + inches / 12.0)
    match = _LENGTH.fullmatch(text)
    if match is None or match[2] not in TABLES["units"]:
        return None
    return _decimal(match[1]) * float(TABLES["units"][match[2]])


def _decimal(text: str) -> float:
    return float(text.replace(",", "."))


def tag_value(
    tags: Mapping[str, str],
    key: str,
    read: Callable[[str], float | None],
    most: float,
    where: tuple[str, ImportFaults] | None,
    least: float = LEAST,
) -> float | None:
    """Returns the value of a tag; None if the tag has no valid value.

    Args:
        tags: tags of an element.
        key: key of the tag.
        read: function that converts the text of the tag to its value; it
            returns None for a text that it cannot convert.
        most: greatest plausible value. A greater value counts as a fault, as
            does a text that `read` cannot convert.
        where: id of the element, and the faults to add to; None if faults are
            not counted.
        least: least plausible value. A smaller value counts as a fault. By
            default, 0 is a fault, too.
    """
    text = tags.get(key)
    if text is None:
        return None
    value = read(text)
    if value is not None and least <= value <= most:
        return value
    if where is not None:
        name, faults = where
        kind = f"{key} unreadable or implausible, the usual one taken"
        faults.add(kind, name, ruins=key in _SIZES)
    return None


def has_tag(tags: Mapping[str, str], name: str) -> bool:
    """Returns whether a tag exists and its value is not `no`."""
    return tags.get(name, "no") != "no"


def is_inside(tags: Mapping[str, str]) -> bool:
    """Returns whether an object is inside a building or below the ground."""
    below = [tags.get(key, "").startswith("-") for key in ("layer", "level")]
    return (
        any(below)
        or tags.get("indoor", "no") != "no"
        or tags.get("location") in ("indoor", "underground", "underwater")
    )
