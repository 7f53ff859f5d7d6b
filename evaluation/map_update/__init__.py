"""Labels of old maps (gone, new, not observed): a public noun.

Baselines predict labels; `score` compares predicted labels with the ground
truth. An `UpkeptMap` is updated by several drives.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
