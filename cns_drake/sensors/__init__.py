"""The sensors of a vehicle: a family (LiDAR, camera, IMU, odometry)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
