"""Structural change between two drives or maps.

`tcr` computes the temporal change ratio of two clouds; `convex_hull` determines
which points of these clouds count. `drive_maps` makes the clouds from drives or
from files, and `drive_change` reports the change.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
