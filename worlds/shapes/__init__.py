"""Shapes, a public noun: meshes, areas, objects, and structures of these.

A kit for what builds or changes a world; nothing here imports Drake.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
