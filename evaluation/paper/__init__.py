"""The paper "The City that Never Settles", beside which results are shown.

`paper_values` contains the paper's numbers. `findings` and `aims` compare the
shipped cities with them, `best_methods` says which methods are best, and
`section` makes the section of a study's page.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
