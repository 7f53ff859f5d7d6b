"""Scans and poses as voxel maps, a public noun: `VoxelMap`, `map_drive`."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
