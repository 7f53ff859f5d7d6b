"""Pictures of a map's stages, and web pages of drives."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
