"""The city generator, a wall: cities from roads and a plan, without Drake.

The city is written as stages in SDF. Buildings, small objects and trees are
families, one file each; imported cities and changes between drives use them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
