"""The scene: a public noun, `World`, with the geometry that sensors see."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
