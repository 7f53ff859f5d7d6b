"""Labels of old maps (gone, new, not observed): a public noun.

Baselines predict labels; `score` compares predicted labels with the ground
truth. An `UpkeptMap` is updated by several drives.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
