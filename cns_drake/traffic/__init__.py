"""Road users that move during a drive: a public noun, the traffic plan.

The motion of vehicles and pedestrians is read before the drive, from a map's
recorded traffic or a trace of SUMO. During the drive, the poses are
interpolated.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
