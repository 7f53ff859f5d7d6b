"""Localisation of single scans, or of a drive, in a map: a public noun.

A scan is registered to a map from an initial pose by an estimator. `localise`
registers many scans independently of each other; `track_drive` registers the
scans of a drive one after another.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
