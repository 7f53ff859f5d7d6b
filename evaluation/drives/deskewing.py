"""Removes the distortion that the motion of the LiDAR causes in a scan."""

from cns_drake.drives.deskewing import deskew

__all__ = ["deskew"]
