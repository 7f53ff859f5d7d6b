"""The program `cns-eval`: a family, a file a verb."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
