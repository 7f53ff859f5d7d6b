"""Divides lanes into those on the ground and those on bridges."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from cns_drake.imports.opendrive.lane_bands import LaneBand

# A road at least this much above another one is a bridge [m].
_HEADROOM = 3.0
# Cell size for finding places above one another, and length of a bridge beyond
# the crossed road [m].
_NEAR, _BEYOND = 2.5, 8.0
_LEAST_WIDTH = 0.1


def split_levels(
    bands: Sequence[LaneBand],
) -> tuple[list[LaneBand], list[LaneBand]]:
    """Returns the lanes on the ground, and those on bridges, cut up."""
    raised = _raised_places(bands)
    ground: list[LaneBand] = []
    bridges: list[LaneBand] = []
    for band in bands:
        above = raised.get(band.road.name)
        if above is None:
            ground.append(band)
            continue
        low, high = np.searchsorted(above, [band.s - _BEYOND, band.s + _BEYOND])
        is_bridge = high > low
        for run, carried in _runs(is_bridge):
            (bridges if carried else ground).append(_cut(band, run))
    return ground, bridges


def _raised_places(bands: Sequence[LaneBand]) -> dict[str, np.ndarray]:
    """Returns road -> places where it passes over another, increasing [m]."""
    names = {band.road.name: k for k, band in enumerate(bands)}
    rows = []
    for band in bands:
        wide = band.width > _LEAST_WIDTH
        for edge in (band.inner, band.middle, band.outer):
            owner = np.full(len(band.s), names[band.road.name])
            rows.append(np.column_stack([edge, band.s, owner])[wide])
    places = np.concatenate(rows) if rows else np.zeros((0, 5))
    if len(places) == 0 or np.ptp(places[:, 2]) < _HEADROOM:
        return {}
    # One place for each square metre is enough: the highest and the lowest.
    tree = cKDTree(places[:, :2])
    found: dict[str, list[float]] = {}
    high = np.flatnonzero(places[:, 2] > places[:, 2].min() + _HEADROOM)
    for k, near in zip(
        high, tree.query_ball_point(places[high, :2], _NEAR), strict=True
    ):
        others = places[near]
        below = others[:, 2] < places[k, 2] - _HEADROOM
        if (below & (others[:, 4] != places[k, 4])).any():
            road = bands[int(places[k, 4])].road.name
            found.setdefault(road, []).append(float(places[k, 3]))
    return {road: np.unique(some) for road, some in found.items()}


def _runs(is_bridge: np.ndarray) -> Iterator[tuple[slice, bool]]:
    """Yields stretches of the same level; neighbours share a place."""
    starts = np.flatnonzero(np.diff(is_bridge.astype(int), prepend=-1))
    for a, b in zip(starts, [*starts[1:], len(is_bridge)], strict=True):
        last = min(b + 1, len(is_bridge))
        if last - a > 1:
            yield slice(int(a), int(last)), bool(is_bridge[a])


def _cut(band: LaneBand, run: slice) -> LaneBand:
    names = ("inner", "outer", "middle", "heading", "roll", "grade", "s")
    return replace(band, **{name: getattr(band, name)[run] for name in names})
