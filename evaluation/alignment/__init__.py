"""Alignment of drives with poses in different worlds: a public noun.

`align` aligns two drives: guesses of the pose, loops between submaps, and a
pose graph fitted to the loops.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
