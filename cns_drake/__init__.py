"""Cities that change, driven and recorded by simulated LiDAR in Drake.

The public names are in `__all__`. A name is imported when it is first used;
`__init__.pyi` says from where.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
