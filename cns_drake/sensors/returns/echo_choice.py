"""Which of the echoes of a beam a unit reports."""

from enum import Enum


class Echoes(str, Enum):
    """Which echoes of a beam a unit reports."""

    FIRST = "first"
    STRONGEST = "strongest"
    LAST = "last"
    DUAL = "dual"
