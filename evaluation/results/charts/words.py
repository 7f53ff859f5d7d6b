"""Factors and their values in the words of charts."""

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
