"""The program `cns-drake` and the diagram scripts: a family, a file a verb."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
