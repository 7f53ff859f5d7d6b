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


def in_words(name: str) -> str:
    """Returns the name of a metric or a factor in words.

    A name with a dot is a factor, such as a setting of a method.
    """
    if name in METRICS:
        return METRICS[name].label
    return _IN_WORDS.get(name, name.rpartition(".")[2].replace("_", " "))


def value_words(value: object, factor: str = "") -> str:
    """Returns the value of a factor in words; lists have no brackets."""
    if factor == STAGE:
        return _STAGES.get(str(value), str(value))
    if factor == CAUSE and value in _CAUSES:
        return _CAUSES[str(value)]
    if isinstance(value, float):
        return f"{value:g}"
    text = re.sub(r"[\[\]]", "", str(value).replace("_", " "))
    return re.sub(r",(?! )", ", ", text)
