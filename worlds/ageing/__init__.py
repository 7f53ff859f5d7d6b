"""Ageing of cities year by year: a public noun, the aged map.

Future events happen at the rates of change of real cities. Past years show the
buildings that had been built by then.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
