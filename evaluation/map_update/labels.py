"""Labels of the points of maps: what happened to each."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

# SemanticKITTI's classes of moving objects, vehicles and people.
MOVING_CLASSES = (*range(252, 260), 10, 11, 13, 15, 18, 20, 30, 31, 32)


class Label(IntEnum):
    """What happened to a point of a map: kept, gone, new or not observed.

    Points of the older map A are kept (1), gone (2) or unobserved (0: the drive
    of B did not look at the point). Points of the newer map B are kept (1), new
    (3) or newly seen (4: the drive of A did not look at the point). IGNORED
    (255) occurs only in ground-truth labels of your own; scores leave out such
    points.
    """

    UNOBSERVED = 0
    KEPT = 1
    GONE = 2
    NEW = 3
    NEWLY_SEEN = 4
    IGNORED = 255


# Labels of each side: unobserved, kept, changed.
SIDES = {
    "A": (Label.UNOBSERVED, Label.KEPT, Label.GONE),
    "B": (Label.NEWLY_SEEN, Label.KEPT, Label.NEW),
}


class PairLabels(NamedTuple):
    """Labels of the points of both maps.

    Attributes:
        A: (N,) uint8 labels of the older map.
        B: (M,) uint8 labels of the newer map.
    """

    A: np.ndarray
    B: np.ndarray
