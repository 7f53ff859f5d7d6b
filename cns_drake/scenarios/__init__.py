"""Scenarios: a public noun, `Scenario`, its files and the planned drive."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
