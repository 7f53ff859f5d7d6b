"""The levels of lanes: on the ground, or on a bridge."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from cns_drake.imports.opendrive.lanes import LEAST_WIDTH, LaneBand

# A road at least this far above another one is a bridge [m].
_HEADROOM = 3.0
# Places are above one another if they are at most this far apart, as seen from
# above [m].
_ABOVE_WITHIN = 2.5
# A bridge extends this far to both sides of the road that it crosses [m].
_BRIDGE_REACH = 8.0
# The arrays of a band, with one row for each place along the road.
_ARRAYS = (
    "inner", "outer", "middle", "heading", "roll", "grade", "rise", "s",
)  # fmt: skip


def split_levels(
    bands: Sequence[LaneBand],
) -> tuple[list[LaneBand], list[LaneBand]]:
    """Returns the lanes on the ground and the lanes on bridges.

    A lane that leads onto a bridge is cut at the bridge's end.
    """
    raised = _raised_places(bands)
    ground: list[LaneBand] = []
    bridges: list[LaneBand] = []
    for band in bands:
        above = raised.get(band.road.name)
        if above is None:
            ground.append(band)
            continue
        low, high = np.searchsorted(
            above, [band.s - _BRIDGE_REACH, band.s + _BRIDGE_REACH]
        )
        is_bridge = high > low
        for run, carried in _stretches_of_one_level(is_bridge):
            parts = {name: getattr(band, name)[run] for name in _ARRAYS}
            level = bridges if carried else ground
            level.append(replace(band, **parts))
    return ground, bridges


def _raised_places(bands: Sequence[LaneBand]) -> dict[str, np.ndarray]:
    """Returns where each road passes over another road.

    The result maps the name of a road to increasing distances along it [m].
    """
    # Roads are numbered by one of their bands.
    number_of = {band.road.name: number for number, band in enumerate(bands)}
    rows = [np.zeros((0, 5))]
    for band in bands:
        wide = band.width > LEAST_WIDTH
        for edge in (band.inner, band.middle, band.outer):
            numbers = np.full(len(band.s), number_of[band.road.name])
            rows.append(np.column_stack([edge, band.s, numbers])[wide])
    places = np.concatenate(rows)
    xy = places[:, :2]
    z, s, number = places[:, 2:].T
    if len(places) == 0 or np.ptp(z) < _HEADROOM:
        return {}
    tree = cKDTree(xy)
    raised: dict[str, list[float]] = {}
    high = np.flatnonzero(z > z.min() + _HEADROOM)
    for place, near in zip(
        high, tree.query_ball_point(xy[high], _ABOVE_WITHIN), strict=True
    ):
        is_below = z[near] < z[place] - _HEADROOM
        if (is_below & (number[near] != number[place])).any():
            road = bands[int(number[place])].road.name
            raised.setdefault(road, []).append(float(s[place]))
    return {road: np.unique(along) for road, along in raised.items()}


def _stretches_of_one_level(
    is_bridge: np.ndarray,
) -> Iterator[tuple[slice, bool]]:
    """Yields stretches of a lane with one level, and whether it is a bridge.

    `is_bridge` (N,) says which places along the lane are on a bridge.
    Neighbouring stretches share a place.
    """
    starts = np.flatnonzero(np.diff(is_bridge.astype(int), prepend=-1))
    for a, b in zip(starts, [*starts[1:], len(is_bridge)], strict=True):
        last = min(b + 1, len(is_bridge))
        if last - a > 1:
            yield slice(int(a), int(last)), bool(is_bridge[a])
