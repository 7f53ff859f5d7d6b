"""Changes between drives: parked cars, leaves, snow, roadworks, height limits.

The changes are made in a loaded world, before it becomes part of a diagram.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
