"""Labels of old maps: what is gone, what is new, what was not observed.

`map_builder` makes the map of a drive. `sessions` reads and writes the maps of
a pair of drives, with the `labels` of the points. `baselines` and `free_space`
predict labels; `scores` and `structures` compare predicted labels with the
ground truth. `upkeep` updates a map by several drives, and `upkept_drive` shows
the updated map in scans.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
