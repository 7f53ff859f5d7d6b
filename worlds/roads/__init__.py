"""Roads: a public noun, `RoadNetwork`, and the routes along its lanes.

Nothing here imports Drake.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
