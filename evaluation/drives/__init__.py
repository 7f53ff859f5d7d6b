"""Recorded drives of public data sets: a family, one module for each.

`open_drive` finds the reader of a folder. Views of drives, and tables of poses,
serve all readers.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
