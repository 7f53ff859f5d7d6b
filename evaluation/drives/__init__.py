"""Recorded drives of public data sets: a family, one module for each.

`open_drive` finds the reader of a folder. Views of drives, and tables of poses,
serve all readers.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
