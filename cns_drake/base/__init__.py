"""What the simulator and the evaluation share: a wall, it knows neither.

Errors, files, numbers, jobs, progress and the frame of command lines. Nothing
here imports Drake.
"""

from cns_drake.base.public_names import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
