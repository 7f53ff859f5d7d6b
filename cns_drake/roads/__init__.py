"""Roads: a public noun, `RoadNetwork`, and the routes along its lanes.

Nothing here imports Drake.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
