"""Recorded drives: a public noun, `Drive`, and its reader of MCAP files.

Nothing here imports Drake, so that the evaluation runs without it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
