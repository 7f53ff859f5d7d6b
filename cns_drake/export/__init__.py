"""Exports of recorded drives: a family; a data set's layout is one file."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
