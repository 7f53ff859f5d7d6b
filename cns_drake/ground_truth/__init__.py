"""Exact ground truth of simulated drives, by rays in worlds: a public noun."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
