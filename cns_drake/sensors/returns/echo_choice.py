"""The choice of echoes that a unit reports."""

from enum import Enum


class Echoes(str, Enum):
    """The echoes of a beam that a unit reports."""

    FIRST = "first"
    STRONGEST = "strongest"
    LAST = "last"
    DUAL = "dual"
