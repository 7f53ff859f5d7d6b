"""Lanes and walkways for traffic on OpenDRIVE roads."""

from collections.abc import Sequence

import numpy as np

from cns_drake.base.polylines import length_of
from cns_drake.imports.opendrive.band_graph import BandGraph, usual_limit_of
from cns_drake.imports.opendrive.lanes import LaneBand
from cns_drake.imports.opendrive.road_heights import KerbHeights
from cns_drake.traffic.lane_file import lane_text
from cns_drake.traffic.lane_graph import Walkway
from cns_drake.traffic.lane_joining import DirectedLane, join_lanes
from cns_drake.traffic.polylines import resampled

_SIDEWALKS = frozenset({"sidewalk", "walking"})
# Least distance of pedestrians from the edges of a sidewalk [m].
_FROM_EDGE = 0.45
# Greatest distance of pedestrians from the middle of a sidewalk [m].
_MOST_HALF_WIDTH = 1.05
# There are no pedestrians where this distance would be smaller [m].
_LEAST_HALF_WIDTH = 0.3
# Least length of a sidewalk with pedestrians [m].
_SHORTEST_WALKWAY = 5.0


def lane_text_of_bands(
    bands: Sequence[LaneBand], kerbs: KerbHeights
) -> str | None:
    """Returns the text of a lane file; None if there is no lane to drive on.

    `bands` contains the lanes of the whole network, and `kerbs` the heights of
    sidewalks above the road.
    """
    graph = BandGraph(bands)
    lanes = [
        DirectedLane(
            line,
            usual_limit_of([band]),
            band.road.junction is not None,
        )
        for band, line in zip(graph.bands, graph.lines, strict=True)
    ]
    joined = join_lanes(lanes, graph.followers)
    if not joined.pieces:
        return None
    sidewalks = [band for band in bands if band.lane.kind in _SIDEWALKS]
    return lane_text(joined, _walkways(sidewalks, kerbs))


def _walkways(bands: Sequence[LaneBand], kerbs: KerbHeights) -> list[Walkway]:
    """Returns a walkway for each sidewalk; pedestrians turn at its ends."""
    walkways: list[Walkway] = []
    for band in bands:
        half = min(float(band.width.min()) / 2 - _FROM_EDGE, _MOST_HALF_WIDTH)
        length = length_of(band.middle)
        if half < _LEAST_HALF_WIDTH or length < _SHORTEST_WALKWAY:
            continue
        first = 2 * len(walkways)
        kerb = kerbs(band.middle[:, :2])
        points = resampled(
            np.column_stack([band.middle[:, :2], band.middle[:, 2] + kerb])
        )
        walkways.append(Walkway(points, half, first, first + 1))
    return walkways
