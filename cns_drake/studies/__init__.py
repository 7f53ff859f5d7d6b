"""Studies of many drives, a wall: in the simulator, they alone evaluate.

`run_study` runs an experiment: it changes drives as the conditions say, makes
the cities that these drives need, and measures the pairs.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
