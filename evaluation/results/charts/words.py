"""Factors and their values in the words of charts."""

import json
import re

from evaluation.recognition import METRICS
from evaluation.results.keys import CAUSE, LAST, OWN, STAGE

# Factors in words, where these differ from the last part of their names.
_IN_WORDS = {
    "protocol.base": "protocol",
    "protocol.turn_queries": "random yaw",
}
# Values of the factor `both.stage`, in words.
_STAGES = {LAST: "without the change", OWN: "with the change"}
# Causes in words, where these differ from the values in tables.
_CAUSES = {
    "hidden": "occluded sector",
    "lateral": "lateral offset",
    "turn": "random yaw",
}
# Units of factors that are lengths, by the last part of their names; of angles,
# the name ends in `_deg`.
_UNITS = dict.fromkeys(
    (
        "xyz",
        "lateral",
        "range_noise",
        "radius",
        "max_range",
        "place_spacing",
        "query_spacing",
    ),
    " m",
)
# Names of the components of a list.
_COMPONENTS = {"xyz": ("x", "y", "z"), "rpy_deg": ("roll", "pitch", "yaw")}
# Which drive a factor changes, in words.
_DRIVES_ALONE = {"database": "a map", "query": "a query"}
_DRIVES = {"database": " in the database", "query": " in the query"}
# Number of characters from which on a list is shortened.
_LONG = 60


def in_words(name: str) -> str:
    """Returns the name of a metric or a factor in words.

    A name with a dot is a factor, such as a setting of a method.
    """
    if name in METRICS:
        return METRICS[name].label
    return _IN_WORDS.get(name, name.rpartition(".")[2].replace("_", " "))


def value_words(value: object, factor: str = "") -> str:
    """Returns the value of a factor in words; lists have no brackets.

    Of a long list the first two values are named.
    """
    if factor == STAGE:
        return _STAGES.get(str(value), str(value))
    if factor == CAUSE and value in _CAUSES:
        return _CAUSES[str(value)]
    if isinstance(value, float):
        return f"{value:g}"
    text = re.sub(r"[\[\]]", "", str(value).replace("_", " "))
    text = re.sub(r",(?! )", ", ", text)
    values = text.split(", ")
    if len(text) <= _LONG or len(values) < 4:
        return text
    return f"{values[0]}, {values[1]} and {len(values) - 2} more"


def change_words(factor: str, before: object, after: object) -> str:
    """Returns a change of a factor in words and units, as a subject.

    Args:
        factor: name of the factor.
        before, after: its values.
    """
    drive, name = factor.partition(".")[0], factor.rpartition(".")[2]
    if name == "stage" and (before, after) == (LAST, OWN):
        return "a rebuilt city"
    thing = _DRIVES_ALONE.get(drive, "a city")
    if name == "years":
        first, last = value_words(before), value_words(after)
        return f"{thing} of age {last} instead of {first} years"
    if name == "missing" and before == 0 and isinstance(after, int | float):
        share = f"{100.0 * after:.0f}\N{NO-BREAK SPACE}%"
        return f"{thing} without {share} of the buildings and plants"
    where = _DRIVES.get(drive, "")
    subject, first, last, unit = _what_differs(factor, before, after)
    if name == "distractors":
        return f"a database with {last} instead of {first} distractors"
    if ".lidars." in factor and name in _COMPONENTS:
        subject, where = f"a LiDAR mounted at {subject}", ""
    elif name == "lidar":
        subject = "a LiDAR"
    return f"{subject} {last} instead of {first}{unit}{where}"


def end_words(factor: str, before: object, after: object) -> tuple[str, str]:
    """Returns the first and the last value of a factor in words and units."""
    if factor == STAGE:
        return value_words(before, factor), value_words(after, factor)
    subject, *ends, unit = _what_differs(factor, before, after)
    first, last = (f"at {subject} {value}{unit}" for value in ends)
    return first, last


def _what_differs(
    factor: str, before: object, after: object
) -> tuple[str, str, str, str]:
    """Returns what differs, its first and last value, and its unit."""
    name = factor.rpartition(".")[2]
    unit = "°" if name.endswith("_deg") else _UNITS.get(name, "")
    ends = _components(name, before, after)
    if ends is None:
        ends = in_words(factor), value_words(before), value_words(after)
    return *ends, unit


def _components(
    name: str, before: object, after: object
) -> tuple[str, str, str] | None:
    """Returns what differs between two lists: name, first and last values.

    The result is None unless a single component differs.
    """
    if name not in _COMPONENTS:
        return None
    try:
        lists = [json.loads(str(value)) for value in (before, after)]
        differ = [
            (component, value_words(first), value_words(last))
            for component, first, last in zip(
                _COMPONENTS[name], *lists, strict=True
            )
            if first != last
        ]
    except (TypeError, ValueError):
        return None
    return differ[0] if len(differ) == 1 else None
