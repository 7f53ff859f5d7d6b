"""Road users that move during a drive: a public noun, the traffic plan.

The motion of vehicles and pedestrians is planned before the drive, from the
roads and a seed. During the drive, the poses are interpolated from this plan.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
