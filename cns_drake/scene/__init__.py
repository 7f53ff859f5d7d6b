"""The scene: a public noun, `World`, with the geometry that sensors see."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
