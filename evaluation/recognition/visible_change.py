"""Visible change: how much of a query's scan its best match does not show."""

from __future__ import annotations

import math

import numpy as np

# Overlap below which two scans show different surroundings.
ENOUGH_OVERLAP = 0.5


def visible_change_added(now: np.ndarray, before: np.ndarray | None) -> float:
    """Returns the mean visible change minus the mean in a baseline.

    The visible change also contains parts of a scan that are occluded only
    because the viewpoints differ (parallax). Subtracting the baseline removes
    this share.

    Args:
        now: (Q,) overlaps, see `PlaceOutcome.of`.
        before: (Q,) overlaps of the same queries in the baseline.

    Returns:
        The difference; NaN if no query has both values, or the queries differ.
    """
    if before is None or len(before) != len(now):
        return math.nan
    added = before - now
    known = added[~np.isnan(added)]
    return float(known.mean()) if len(known) else math.nan


def mean_visible_change(overlaps: np.ndarray) -> tuple[float, int]:
    """Returns the mean visible change, and the number of queries.

    The visible change of a query is the share of its scan that the best of its
    matches does not show.

    Args:
        overlaps: (Q,) see `PlaceOutcome.of`; NaN for queries that have no
            match, which do not count.

    Returns:
        The mean and the number of queries with a match; NaN and 0 if there are
        none.
    """
    known = overlaps[~np.isnan(overlaps)]
    if len(known) == 0:
        return math.nan, 0
    return float(1.0 - known.mean()), len(known)
