"""Scans and poses as voxel maps, a public noun: `VoxelMap`, `map_drive`."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
