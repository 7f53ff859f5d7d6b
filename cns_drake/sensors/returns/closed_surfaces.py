"""Whether a surface encloses a volume."""

from __future__ import annotations

import numpy as np

from cns_drake.scene.surfaces import (
    HalfSpaceSurface,
    Surface,
    TriangleSurface,
)


def is_closed(surface: Surface) -> bool:
    """Returns whether a surface encloses a volume.

    Triangles do if each edge, by the places of its ends, belongs to an even
    number of them.
    """
    if isinstance(surface, HalfSpaceSurface):
        return False
    if not isinstance(surface, TriangleSurface):
        return True
    _, place = np.unique(
        np.round(surface.p_GVset, 6), axis=0, return_inverse=True
    )
    corners = np.reshape(place, -1)[surface.triangles]
    edges = np.sort(
        np.concatenate(
            [corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]
        ),
        axis=1,
    )
    _, count = np.unique(edges, axis=0, return_counts=True)
    return bool(len(edges) > 0 and np.all(count % 2 == 0))
