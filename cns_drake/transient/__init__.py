"""Changes between drives: a family, one file a cause of change.

Parked cars, leaves, snow, roadworks, furniture, scaffolds and height limits are
changed in a loaded world, before it becomes part of a diagram.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
