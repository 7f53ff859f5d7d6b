"""Assembles the points of a scan from its measurements.

The loop is compiled: a dozen passes of numpy take four times as long.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.scene.semantics import CLASS_IDS

# The class of points without a structure.
SCATTERED_LABEL = CLASS_IDS["outlier"]


class BeamTable(NamedTuple):
    """Constants of all scans, for all beams in firing order.

    Attributes:
        d_Sset: (num_beams, 3) float32 unit directions, expressed in S.
        ring: (num_beams,) uint16.
        t_ns: (num_beams,) uint32 firing time since the start of the turn.
        place: (num_beams,) position of each beam in the order of casting.
    """

    d_Sset: np.ndarray
    ring: np.ndarray
    t_ns: np.ndarray
    place: np.ndarray


@compiled
def assemble_points(
    scan: np.ndarray,
    table: BeamTable,
    beams: np.ndarray,
    ranges: np.ndarray,
    intensity: np.ndarray,
    met: np.ndarray,
    label: np.ndarray,
    instance: np.ndarray,
    step: np.float32,
) -> None:
    """Fills a scan, one point for each return.

    Args:
        scan: (N,) `POINT_DTYPE` to fill.
        table: a `BeamTable`.
        beams: (N,) the beams with a return.
        ranges: (N,) float32 measured along them [m].
        intensity: (N,) float32.
        met: (N,) int32 index of the hit geometry in `label` and `instance`;
            negative for the weather.
        label: uint16 classes.
        instance: uint16 structures.
        step: coordinates are rounded to multiples of it [m]; not rounded if 0.
    """
    for k in range(len(beams)):
        # For a signed index, numba looks at each use whether it counts from
        # the end.
        beam = np.uint64(beams[k])
        x = table.d_Sset[beam, 0] * ranges[k]
        y = table.d_Sset[beam, 1] * ranges[k]
        z = table.d_Sset[beam, 2] * ranges[k]
        if step > 0:
            x = np.rint(x / step) * step
            y = np.rint(y / step) * step
            z = np.rint(z / step) * step
        point = scan[k]
        point.x = x
        point.y = y
        point.z = z
        point.intensity = intensity[k]
        point.ring = table.ring[beam]
        point.t = table.t_ns[beam]
        if met[k] < 0:
            point.label, point.instance = SCATTERED_LABEL, 0
        else:
            geometry = np.uint64(met[k])
            point.label = label[geometry]
            point.instance = instance[geometry]


def points_in_world(
    scan: np.ndarray,
    column_t_ns: np.ndarray,
    p_WSset: np.ndarray,
    R_WSset: np.ndarray,
) -> np.ndarray:
    """Returns the places of a scan's points in the world, (N, 3) [m].

    Args:
        scan: (N,) records of `POINT_DTYPE`.
        column_t_ns: (T,) rising firing times of the columns [ns].
        p_WSset: (K, 3) positions of S: one, or each column's.
        R_WSset: (K, 3, 3) its orientations.
    """
    column = np.searchsorted(column_t_ns, scan["t"])
    p_SRset = np.stack([scan["x"], scan["y"], scan["z"]], axis=1)
    return p_WSset[column % len(p_WSset)] + np.einsum(
        "nij,nj->ni", R_WSset[column % len(R_WSset)], p_SRset
    )
