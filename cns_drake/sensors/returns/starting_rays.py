"""The rays that stand for beams: one each, or several at an edge."""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.sensors.returns.footprint import NUM_SUB_RAYS, sub_directions
from cns_drake.sensors.returns.propagation import Ways


@compiled
def start_ways(
    key: np.uint64,
    whole: np.ndarray,
    edges: np.ndarray,
    beam: np.ndarray,
    d_Sset: np.ndarray,
    p_WSset: np.ndarray,
    R_WSset: np.ndarray,
    times: np.ndarray,
    divergence: float,
    ways: Ways,
) -> None:
    """Fills in the rays of beams.

    Args:
        key: of the frame; see `frame_key`.
        whole: (M,) rows of the beams that one ray stands for.
        edges: (E,) rows of those that `NUM_SUB_RAYS` rays stand for.
        beam: (N,) number of each beam.
        d_Sset: (N, 3) its direction.
        p_WSset: (K, 3) positions of S, taken in turn.
        R_WSset: (L, 3, 3) its orientations, taken in turn.
        times: (T,) parts of the turn, taken in turn.
        divergence: half angle of a beam [rad].
        ways: (M + `NUM_SUB_RAYS` E,) to fill: whole beams first.
    """
    d_W = np.empty(3)
    d_sub = np.empty((NUM_SUB_RAYS, 3))
    way = 0
    for k in range(len(whole) + len(edges)):
        row = whole[k] if k < len(whole) else edges[k - len(whole)]
        R = R_WSset[row % len(R_WSset)]
        for i in range(3):
            d_W[i] = 0.0
            for j in range(3):
                d_W[i] += R[i, j] * d_Sset[row, j]
        count = 1
        if k >= len(whole):
            count = NUM_SUB_RAYS
            sub_directions(key, beam[row], d_W, divergence, d_sub)
        for sub in range(count):
            ways.beam[way] = beam[row]
            ways.sub[way] = sub
            for axis in range(3):
                ways.p_Wset[way, axis] = p_WSset[row % len(p_WSset), axis]
                ways.d_Wset[way, axis] = (
                    d_W[axis] if count == 1 else d_sub[sub, axis]
                )
            ways.time[way] = times[row % len(times)]
            ways.length[way] = 0.0
            ways.energy[way] = 1.0 / count
            ways.depth[way] = np.inf
            ways.inside[way] = -1
            way += 1
