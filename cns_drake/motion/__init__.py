"""The vehicle's motion: a public noun, `Trajectory`, along a path of lanes."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
