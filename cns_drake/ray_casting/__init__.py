"""Ray casting on the geometry of a SceneGraph."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
