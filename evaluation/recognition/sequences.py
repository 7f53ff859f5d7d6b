"""Matching of sequences: the queries along a way vote together.

As in SeqSLAM (Milford and Wyeth, ICRA 2012), scores are summed along straight
lines in the matrix of queries and places. There the speeds of both drives are
unknown; here distances along both ways are known, so each line has one slope.
"""

import numpy as np

from evaluation.drives.sampling import travelled


def along_the_way(
    scores: np.ndarray,
    is_known: np.ndarray,
    p_WQs: np.ndarray,
    p_WPs: np.ndarray,
    length: float,
) -> np.ndarray:
    """Returns scores (Q, D) that are averaged along the path.

    It is the mean of the query's own score and those of the queries before it,
    each for the place that lies as far from the place as that query lies from
    the last one: before it along the database's way, or behind it if the drive
    goes the other way. The better direction counts. What lies beyond the ends
    of the way has no vote, nor has a query without a candidate; a missing score
    counts as the least of its query.

    Args:
        scores: (Q, D) of single queries, NaN for no candidate.
        is_known: (Q, D) bool, places that may be found.
        p_WQs: (Q, 3) positions of the queries, in the order of the drive [m].
        p_WPs: (D, 3) positions of the places in the world [m].
        length: greatest distance of a voting query, along its way [m].
    """
    of_query, of_place = travelled(p_WQs), travelled(p_WPs)
    between = (of_place[1:] + of_place[:-1]) / 2.0
    least = np.fmin.reduce(scores, axis=1, keepdims=True)
    filled = np.where(np.isnan(scores), least, scores)
    result = np.empty_like(scores)
    for row, end in enumerate(of_query):
        first = int(np.searchsorted(of_query, end - length))
        back = (end - of_query[first : row + 1])[:, None]
        voting = filled[first : row + 1]
        means = []
        for at in (of_place - back, of_place + back):
            votes = np.take_along_axis(
                voting, np.searchsorted(between, at), axis=1
            )
            votes[(at < 0.0) | (at > of_place[-1])] = np.nan
            number = (~np.isnan(votes)).sum(axis=0)
            with np.errstate(invalid="ignore"):
                means.append(np.nansum(votes, axis=0) / number)
        result[row] = np.fmax(*means)
    return np.where(is_known, result, np.nan)
