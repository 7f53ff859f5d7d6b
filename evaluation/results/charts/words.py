"""Metrics, factors and their values in the words of charts."""

import re

from evaluation.results.keys import CAUSE, LAST, OWN, STAGE

# Metrics and factors in words.
_IN_WORDS = {
    "auc": "AUC",
    "auc_strict": "AUC strict",
    "r1": "R@1",
    "kept": "retained share",
    "tcr_sym": "TCR_sym",
    "miou": "mean IoU",
    "visible_change_added": "visible change without parallax",
    "query_time": "time of a query [s]",
    "build_time": "time to build the database [s]",
    "memory": "memory of the descriptors [bytes]",
    "success_03m_1deg": "success within 0.3 m and 1 deg",
    "success_2m_5deg": "success within 2 m and 5 deg",
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
    """Returns the name of a metric or a factor in words."""
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
