"""Lanes and sidewalks of an imported road network, for traffic."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cns_drake.imports.opendrive.lane_bands import LaneBand
from cns_drake.imports.opendrive.lane_drives import BandGraph
from cns_drake.traffic.lane_file import lane_text
from cns_drake.traffic.lane_graph import resampled
from cns_drake.traffic.lane_joining import DirectedLane, join_lanes
from cns_drake.traffic.walkways import Walkway

# Speed limit of roads without one [m/s].
_LIMIT = 13.9
_SIDEWALKS = frozenset({"sidewalk", "walking"})
# Walkers' least distance from the edges of a sidewalk, and greatest from its
# middle [m].
_MARGIN, _MOST_HALF_WIDTH = 0.45, 1.05
_LEAST_HALF_WIDTH, _SHORTEST = 0.3, 5.0


def lanes_for_traffic(bands: Sequence[LaneBand], kerb: float) -> str | None:
    """Returns the text of a file of lanes; None if no vehicle can drive on.

    Args:
        bands: lanes of the whole network.
        kerb: how high sidewalks stand above the road [m].
    """
    graph = BandGraph(bands)
    lanes = [
        DirectedLane(
            line,
            min((limit for _, limit in band.road.limits), default=_LIMIT),
            band.road.junction is not None,
        )
        for band, line in graph.driven()
    ]
    joined = join_lanes(lanes, graph.followers())
    if not joined.pieces:
        return None
    walks = [band for band in bands if band.lane.kind in _SIDEWALKS]
    return lane_text(joined, _walkways(walks, kerb))


def _walkways(bands: Sequence[LaneBand], kerb: float) -> list[Walkway]:
    """Returns a strip for each sidewalk, on which walkers turn round."""
    found: list[Walkway] = []
    for band in bands:
        half = min(float(band.width.min()) / 2 - _MARGIN, _MOST_HALF_WIDTH)
        steps = np.linalg.norm(np.diff(band.middle, axis=0), axis=1)
        if half < _LEAST_HALF_WIDTH or steps.sum() < _SHORTEST:
            continue
        first = 2 * len(found)
        points = resampled(band.middle + np.array([0.0, 0.0, kerb]))
        found.append(Walkway(points, half, first, first + 1))
    return found
