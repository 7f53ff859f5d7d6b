"""A LiDAR's data sheet: a family, in which each LiDAR is one file.

The sheets that ship with the package are the presets, `sheets/NAME.yaml`. A
user's own sheet is the same kind of file. All other packages take the rings,
ranges and errors of a LiDAR from here. Nothing here imports Drake.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
