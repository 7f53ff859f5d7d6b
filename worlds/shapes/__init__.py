"""Shapes, a public noun: meshes, areas, structures, and paths of cars.

A kit for what builds, changes or drives through a world. Nothing here imports
Drake.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
