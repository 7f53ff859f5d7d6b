"""The vehicle's motion: from a path along lanes to poses over time."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
