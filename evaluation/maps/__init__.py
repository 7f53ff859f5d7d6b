"""Scans and poses as voxel maps.

`voxel_maps` makes maps of drives and clouds, by means of the hash table in
`voxel_table`. `thumbnails` reduces single scans to small pictures, and
`grid_cells` numbers the cells of grids.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
