"""Cities that change: their maps, shapes, roads, imports and ageing.

The folders of the four cities lie beside the packages that make them. Nothing
here imports Drake. `__all__` lists the public names, which are imported when
they are first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
