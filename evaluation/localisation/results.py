"""Results of localised scans: a record for each, a summary, and tables."""

from collections.abc import Iterator
import math
from pathlib import Path

import numpy as np

from cns_drake.base import json_values, write_csv
from evaluation.clouds import OnNote
from evaluation.localisation.localisation_map import FEWEST_POINTS
from evaluation.recognition import (
    SUCCESS_ROTATION_DEG,
    SUCCESS_TRANSLATION,
    Number,
    auroc,
)

# Results with errors of at most these are right [m, deg].
RIGHT_TRANSLATION = 0.3
RIGHT_ROTATION_DEG = 1.0
# Numbers of the summary that go into a table of results.
_SHOWN = (
    "success_03m_1deg",
    "success_2m_5deg",
    "translation_median",
    "translation_95",
    "rotation_median_deg",
    "auroc_own_score",
)
# Success rate -> greatest errors of a success [m, deg].
_SUCCESSES = {
    "success_03m_1deg": (RIGHT_TRANSLATION, RIGHT_ROTATION_DEG),
    "success_2m_5deg": (SUCCESS_TRANSLATION, SUCCESS_ROTATION_DEG),
}
# Quantile of errors -> field of `QUERY`, and share of smaller errors.
_QUANTILES = {
    "translation_median": ("translation_error", 0.5),
    "translation_95": ("translation_error", 0.95),
    "rotation_median_deg": ("rotation_error_deg", 0.5),
    "rotation_95_deg": ("rotation_error_deg", 0.95),
}
# Directions of the car, in which errors are measured.
_DIRECTIONS = ("along", "across", "up")
# Share of the right results whose scores pass the suggested threshold.
_BELIEVED = 0.95
# Fields of an initial pose: its offset in W [m], and its turn as a rotation
# vector in S.
_INITIAL = (
    *(f"start_{axis}" for axis in "xyz"),
    *(f"start_turn_{axis}_deg" for axis in "xyz"),
)
# Fields that are measured: errors of the result; scores; standard deviations of
# the result from its covariance [m]; the share of the scan that, at the
# ground-truth pose, has no point of the map within a voxel, NaN if the scan has
# too few points to be aligned.
MEASURED = (
    "translation_error",
    "rotation_error_deg",
    *_DIRECTIONS,
    "own_score",
    "fit",
    "residual",
    *(f"std_{name}" for name in _DIRECTIONS),
    "unmapped",
)
# One row per query: its frame and time, its initial pose, what is measured, the
# number of steps, and CPU time [s].
QUERY = np.dtype(
    [
        ("frame", "<i8"),
        ("stamp_ns", "<i8"),
        *((name, "<f8") for name in (*_INITIAL, *MEASURED)),
        ("iterations", "<i8"),
        ("seconds", "<f8"),
    ]
)
COLUMNS = tuple(QUERY.fields or ())


def is_right(
    rows: np.ndarray,
    translation: float = RIGHT_TRANSLATION,
    rotation_deg: float = RIGHT_ROTATION_DEG,
) -> np.ndarray:
    """Returns which results have errors within given limits, (K,) bool.

    Args:
        rows: (K,) results, records of `QUERY`.
        translation: greatest error of the position [m].
        rotation_deg: greatest error of the orientation [deg].
    """
    return (rows["translation_error"] <= translation) & (
        rows["rotation_error_deg"] <= rotation_deg
    )


def note_sparse(name: str, rows: np.ndarray, on_note: OnNote) -> None:
    """Notes how many scans had too few points to be aligned, if any.

    Args:
        name: name of the query drive.
        rows: (K,) results, records of `QUERY`.
        on_note: is called with the note.
    """
    if sparse := np.count_nonzero(np.isnan(rows["unmapped"])):
        on_note(
            f"{name}: {sparse} of {len(rows)} scans have fewer than"
            f" {FEWEST_POINTS} points after thinning; they count as"
            " failures"
        )


def localisation_summary(rows: np.ndarray) -> dict[str, float | int | None]:
    """Returns a summary of localised scans, for JSON.

    Success rates count all queries; quantiles count only queries with a pose.

    Args:
        rows: (K,) results, records of `QUERY`.

    Returns:
        Name -> number; None for a number that is undefined:

        - `queries`, `without_pose`: numbers of queries, and of those without a
          pose.
        - `success_...`: shares of queries within the errors in the name.
        - `translation_...` [m], `rotation_...` [deg]: quantiles of the errors.
        - `along_median`, `std_along_median`: median error along the car, and
          median of the standard deviation that the estimator states [m]; the
          same `across` the car and `up`.
        - `auroc_...`: how well a score tells right from wrong results.
        - `believed_from`: threshold of trust, which most right results reach.
        - `confident_wrong`, `confident_of_wrong`: wrong results with a score of
          at least this threshold, as a share of all and of the wrong results.
        - `unmapped_mean`: mean share of a scan that the map lacks.
        - `seconds_mean`: mean CPU time [s].
    """
    is_posed = ~np.isnan(rows["translation_error"])
    found: dict[str, float | int | None] = {
        "queries": len(rows),
        "without_pose": len(rows) - int(is_posed.sum()),
    }
    for name, limits in _SUCCESSES.items():
        found[name] = float(is_right(rows, *limits).mean())
    found |= _error_quantiles(rows[is_posed])
    found |= _score_aurocs(rows)
    found |= _confidence(rows)
    known = rows["unmapped"][~np.isnan(rows["unmapped"])]
    found["unmapped_mean"] = float(known.mean()) if len(known) else None
    found["seconds_mean"] = float(rows["seconds"].mean())
    return json_values(found)


def _error_quantiles(posed: np.ndarray) -> dict[str, float | None]:
    """Returns the quantiles of errors in `localisation_summary`.

    Args:
        posed: (K,) results with a pose, records of `QUERY`.
    """

    def quantile(name: str, part: float) -> float | None:
        values = np.abs(posed[name])
        return float(np.quantile(values, part)) if len(values) else None

    found = {name: quantile(*of) for name, of in _QUANTILES.items()}
    for name in _DIRECTIONS:
        found[f"{name}_median"] = quantile(name, 0.5)
        found[f"std_{name}_median"] = quantile(f"std_{name}", 0.5)
    return found


def _score_aurocs(rows: np.ndarray) -> dict[str, float]:
    """Returns how well each score tells right from wrong results (AUROC).

    Args:
        rows: (K,) results, records of `QUERY`.
    """
    right = is_right(rows)
    # A small residual, or a small deviation, is a high score.
    deviation = np.max([rows[f"std_{name}"] for name in _DIRECTIONS], axis=0)
    scores = {
        "own_score": rows["own_score"],
        "fit": rows["fit"],
        "residual": -rows["residual"],
        "hessian": -deviation,
    }
    return {f"auroc_{name}": auroc(s, right) for name, s in scores.items()}


def _confidence(rows: np.ndarray) -> dict[str, float | None]:
    """Returns the threshold of confident results, and how many are wrong.

    The threshold is the score that a share `_BELIEVED` of the right results
    reaches. Without a right result, it and the shares of wrong results are NaN.

    Args:
        rows: (K,) results, records of `QUERY`.
    """
    right = is_right(rows)
    wrong = int((~right).sum())
    least = harmful = math.nan
    if right.any():
        scores = rows["own_score"]
        least = float(
            np.quantile(scores[right], 1.0 - _BELIEVED, method="lower")
        )
        harmful = float(((scores >= least) & ~right).sum())
    return {
        "believed_from": least,
        "confident_wrong": harmful / len(rows),
        "confident_of_wrong": harmful / wrong if wrong else None,
    }


def localisation_numbers(rows: np.ndarray, method: str) -> Iterator[Number]:
    """Yields a method's results for `results.csv`, a `Number` for each metric.

    Args:
        rows: (K,) results, records of `QUERY`.
        method: name of the method.
    """
    found = localisation_summary(rows)
    for name in _SHOWN:
        if (value := found[name]) is not None:
            yield Number(method, False, name, float(value), n=len(rows))


def localisation_columns(rows: np.ndarray) -> dict[str, np.ndarray]:
    """Returns the columns of `queries.csv`: a mapping from name to values (K,).

    Args:
        rows: (K,) results, records of `QUERY`.
    """
    scores = rows["own_score"]
    return {
        "query_frame": rows["frame"],
        "query_stamp_ns": rows["stamp_ns"],
        "correct": is_right(rows),
        # Queries are where the map is.
        "has_match": np.ones(len(rows), bool),
        "score": np.where(np.isfinite(scores), scores, np.nan),
        "translation_error": rows["translation_error"],
        "rotation_error_deg": rows["rotation_error_deg"],
    }


def write_rows(rows: np.ndarray, path: Path) -> None:
    """Writes results as CSV, one row per query; unknown numbers are empty."""
    cells = (
        [
            ""
            if isinstance(value, float) and not math.isfinite(value)
            else value
            for value in row
        ]
        for row in rows.tolist()
    )
    write_csv(path, rows.dtype.names or (), cells)
