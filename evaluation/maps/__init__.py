"""Scans and poses as voxel maps."""
