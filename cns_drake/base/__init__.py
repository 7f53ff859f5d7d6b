"""Code that the simulator and the evaluation share: errors, files, jobs."""

from cns_drake.base.public_names import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
