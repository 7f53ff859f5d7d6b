"""The common tables of all results, a public noun: `Results`, `QueryRows`.

Summaries, rankings, comparisons, charts and pages are made from these tables,
whatever wrote them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
