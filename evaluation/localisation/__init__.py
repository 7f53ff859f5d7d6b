"""Localisation of single scans, or of a drive, in a map: a public noun.

A scan is registered to a map from an initial pose by an estimator. `localise`
registers many scans independently of each other; `track_drive` registers the
scans of a drive one after another.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
