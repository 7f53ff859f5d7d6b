"""Public real scans, measured as a study measures simulated scans.

`data_sets` opens the scans, `real_study` measures methods on them, and `judge`
trains a classifier to distinguish real from simulated scans.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
