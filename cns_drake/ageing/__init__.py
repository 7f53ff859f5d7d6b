"""Ageing of cities year by year: a public noun, the aged map.

Future events happen at the rates of change of real cities. Past years show the
buildings that had been built by then.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
