"""The sensors of a vehicle: a family (LiDAR, camera, IMU, odometry)."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
