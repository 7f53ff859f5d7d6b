"""How well scores separate positives from negatives (AUROC)."""

import math

import numpy as np


def auroc(scores: np.ndarray, is_positive: np.ndarray) -> float:
    """Returns the area under the receiver operating characteristic.

    The area is the probability that a positive has a higher score than a
    negative; equal scores count half. The result is NaN if all items or no
    items are positive.

    Args:
        scores: (N,) scores; NaN is the lowest.
        is_positive: (N,) bool.
    """
    # Imported here: it is slow to load.
    from scipy.stats import mannwhitneyu

    values = np.where(np.isnan(scores), -np.inf, scores)
    positive, negative = values[is_positive], values[~is_positive]
    if not (len(positive) and len(negative)):
        return math.nan
    test = mannwhitneyu(positive, negative, method="asymptotic")
    return float(test.statistic / (len(positive) * len(negative)))
