"""The city generator: makes a city in SDF from roads, a plan and stages."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
