"""Exact ground truth of simulated drives, from rays cast in worlds."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
