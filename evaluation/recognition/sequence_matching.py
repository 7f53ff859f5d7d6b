"""Sequence matching: successive queries along a path vote together.

As in SeqSLAM (Milford and Wyeth, ICRA 2012), scores are summed along straight
lines in the matrix of queries and places. SeqSLAM does not know the speeds of
the drives and tries several slopes. Here the distances along both paths are
known, so that there is only one slope.
"""

import numpy as np

from evaluation.drives import travelled


def sequence_scores(
    scores: np.ndarray,
    is_known: np.ndarray,
    p_WQs: np.ndarray,
    p_WPs: np.ndarray,
    length: float,
    drive_of: np.ndarray | None = None,
) -> np.ndarray:
    """Returns scores (Q, D) that are averaged along the path.

    The new score of query q and place p is the mean of the score of q for p and
    of one score of each earlier query. Let d be the distance from an earlier
    query to q. If both drives go in the same direction, the earlier query
    contributes its score for the place at the distance d before p; if the
    drives go in opposite directions, the earlier query contributes its score
    for the place at the distance d after p. The new score is the better of the
    means for the two directions. Distances are along the paths.

    An earlier query is left out of the mean if it has no candidates, or if the
    database's path ends within the distance d from p. An earlier query that has
    candidates, but no score for that place, contributes its least score.

    Args:
        scores: (Q, D) scores of single queries; NaN for places that are no
            candidates.
        is_known: (Q, D) bool, places that are allowed as answers.
        p_WQs: (Q, 3) positions of the queries, in the order of the drive [m].
        p_WPs: (D, 3) positions of the places in the world [m].
        length: earlier queries count up to this distance before the query,
            along the path of the queries [m].
        drive_of: (D,) number of the drive of each place, in ascending order.
            Paths of different drives are not connected. By default all places
            are of one drive.
    """
    least = np.fmin.reduce(scores, axis=1, keepdims=True)
    filled = np.where(np.isnan(scores), least, scores)
    of_query = travelled(p_WQs)
    starts: list[int] = []
    if drive_of is not None:
        starts = (np.flatnonzero(np.diff(drive_of)) + 1).tolist()
    parts = zip(
        np.split(filled, starts, axis=1), np.split(p_WPs, starts), strict=True
    )
    result = np.concatenate(
        [
            _mean_scores(of_drive, of_query, travelled(p), length)
            for of_drive, p in parts
        ],
        axis=1,
    )
    return np.where(is_known, result, np.nan)


def _mean_scores(
    filled: np.ndarray,
    of_query: np.ndarray,
    of_place: np.ndarray,
    length: float,
) -> np.ndarray:
    """Returns the mean scores (Q, D) of the places of one drive."""
    between = (of_place[1:] + of_place[:-1]) / 2.0
    result = np.empty_like(filled)
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
    return result
