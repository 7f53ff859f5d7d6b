"""Recorded drives: a public noun, `Drive`, and its reader of MCAP files.

Nothing here imports Drake, so that the evaluation runs without it.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
