"""The common tables of all results, a public noun: `Results`, `QueryRows`.

Summaries, rankings, comparisons, charts and pages are made from these tables,
whatever wrote them.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
