"""Simulation: a public noun, `simulate`, from a scenario to a recording."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
