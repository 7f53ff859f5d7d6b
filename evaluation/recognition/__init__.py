"""Place recognition between two drives, a public noun.

A `RetrievalProtocol` says which scans are places and queries. Methods describe
them; `retrieve` ranks the places of each query; a `PlaceOutcome` holds the
answers, from which metrics are computed. `measure_places` does all of this for
one pair of drives and several methods.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
