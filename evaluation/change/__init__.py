"""Structural change between two drives or maps: a public noun.

The temporal change ratio (TCR) of two clouds, and the maps of drives and files
from which it is computed.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
