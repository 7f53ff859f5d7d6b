"""The vehicle's motion: a public noun, `Trajectory`, along a path of lanes."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
