"""The names of methods in tables and charts, and their order."""

from collections.abc import Iterable
import math

from evaluation.methods import METHODS


def title(label: str) -> str:
    """Returns the name of a method as its authors write it, with its settings.

    Args:
        label: name of the method as on the command line and, after a comma, its
            settings, if any.
    """
    method, comma, settings = label.partition(",")
    name = METHODS[method].title if method in METHODS else method
    return f"{name}{comma}{settings}"


def in_table_order(methods: Iterable[str]) -> list[str]:
    """Returns methods in the order of tables.

    Methods that are not known, and labels with settings, follow, sorted by
    name.
    """

    def place(method: str) -> tuple[float, str]:
        known = METHODS.get(method)
        return (known.order if known else math.inf), method

    return sorted(set(methods), key=place)
