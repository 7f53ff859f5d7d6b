"""The city generator, a wall: cities from roads and a plan, without Drake.

The city is written as stages in SDF. Buildings, small objects and trees are
families, one file each; imported cities and changes between drives use them.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
