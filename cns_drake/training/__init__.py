"""Trains the method `learned` on scans of drawn cities: a wall around JAX.

In a batch, scans of one drive are queries for places of another drive through
the same city. The training compares queries and places in the same way as the
method. The loss is the cross entropy between a softmax over all places of the
batch and the target weights of the places. If exact overlaps are known, the
target weight of a place grows with the overlap of its scan with the query's
scan; otherwise it falls with the distance of the place from the query. Places
that are more similar to the query thus rank higher than less similar places.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
