"""Structural change between two drives or maps: a public noun.

The temporal change ratio (TCR) of two clouds, and the maps of drives and files
from which it is computed.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
