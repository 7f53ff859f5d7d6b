"""The paper "The City that Never Settles", beside results: a wall.

The rest of the evaluation does not know the paper. The section of a study's
page compares the shipped cities with the paper's numbers.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
