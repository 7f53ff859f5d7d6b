"""Localisation of single scans, or of a drive, in a map.

`localisation_map` makes a map, and `estimators` registers a scan to this map
from one of the random `initial_poses`. `localise` registers many scans
independently of each other; `tracking` registers the scans of a drive one after
another. `results` summarises the records of both. `robust_icp` and `fit` are
parts of estimators, and `settings` contains the settings of estimators.
`one_scan` reads a single cloud as a drive.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
