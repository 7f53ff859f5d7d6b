"""Labels and instance ids of points, by the geometry that was hit."""

from collections.abc import Sequence

import numpy as np

from evaluation.base import OTHER_MOVING_ID, check_instances


def number_structures(
    names: Sequence[str],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns labels for structures whose classes are unknown.

    Instance ids count from 1, in alphabetical order of the names.

    Args:
        names: for each of G geometries, the name of its structure.

    Returns:
        (G,) uint16 class, class while it moves, and instance id.

    Raises:
        InputError: there are more structures than instance ids.
    """
    unique, place = np.unique(np.array(names, str), return_inverse=True)
    check_instances(len(unique))
    return (
        np.zeros(len(names), np.uint16),
        np.full(len(names), OTHER_MOVING_ID, np.uint16),
        (place.reshape(-1) + 1).astype(np.uint16),
    )
