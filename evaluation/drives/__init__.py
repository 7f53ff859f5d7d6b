"""Readers of recorded drives, one for each format, and views of drives."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
