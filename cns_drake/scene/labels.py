"""Labels and instance ids of points, by the geometry that was hit."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cns_drake.base import InputError

# Greatest instance id of a structure.
MAX_INSTANCE = 2**16 - 1
# SemanticKITTI's class of moving objects that have no moving class of their
# own.
OTHER_MOVING_ID = 259


class Labels(NamedTuple):
    """Labels and instance ids of the points on each of G geometries.

    Attributes:
        label: (G,) uint16 class.
        moving_label: (G,) uint16 class while the geometry moves.
        instance: (G,) uint16 id of the structure.
    """

    label: np.ndarray
    moving_label: np.ndarray
    instance: np.ndarray


def number_structures(names: Sequence[str]) -> Labels:
    """Returns labels for structures whose classes are unknown.

    Instance ids count from 1, in alphabetical order of the names.

    Args:
        names: for each of G geometries, the name of its structure.

    Raises:
        InputError: there are more structures than instance ids.
    """
    unique, place = np.unique(np.array(names, str), return_inverse=True)
    check_count(len(unique))
    return Labels(
        np.zeros(len(names), np.uint16),
        np.full(len(names), OTHER_MOVING_ID, np.uint16),
        (place.reshape(-1) + 1).astype(np.uint16),
    )


def check_count(num_structures: int) -> None:
    """Checks that there are instance ids for all structures of a world.

    Raises:
        InputError: there are more structures than instance ids.
    """
    if num_structures > MAX_INSTANCE:
        raise InputError(
            f"the world has {num_structures} structures, but an instance id "
            f"has room for {MAX_INSTANCE}"
        )
