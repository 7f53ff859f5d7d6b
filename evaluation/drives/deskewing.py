"""Undoing the distortion of scans that a moving LiDAR takes."""

from cns_drake.base.drives.deskewing import deskew

__all__ = ["deskew"]
