"""Imports of real cities and road networks: a family, one folder a format.

The result is a map with drives. This package is also a wall: it alone needs
osmium, pyproj and the readers of formats, and it does without Drake.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
