"""Files of single point clouds: a family, one module for each format."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
