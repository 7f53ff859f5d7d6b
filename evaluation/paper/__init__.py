"""The paper "The City that Never Settles", beside results: a wall.

The rest of the evaluation does not know the paper. The section of a study's
page compares the shipped cities with the paper's numbers.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
