"""Imports real cities and road networks as maps with drives."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
