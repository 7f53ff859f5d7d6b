"""Place recognition between two drives, a public noun.

A `RetrievalProtocol` says which scans are places and queries. Methods describe
them; `retrieve` ranks the places of each query; a `PlaceOutcome` holds the
answers, from which metrics are computed.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
