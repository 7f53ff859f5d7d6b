"""Changes between drives: a family, one file a cause of change.

Parked cars, leaves, snow, roadworks, furniture, scaffolds and height limits are
changed in a loaded world, before it becomes part of a diagram.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
