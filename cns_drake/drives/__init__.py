"""Recorded drives: their common interface, and the reader of MCAP files."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
