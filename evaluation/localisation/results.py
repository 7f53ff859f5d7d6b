"""Results of localised scans: a record for each, a summary, and tables."""

from collections.abc import Iterator
import math
from pathlib import Path

import numpy as np

from cns_drake.base.csv_files import write_csv
from cns_drake.base.json_text import json_values
from evaluation.clouds.notes import OnNote
from evaluation.localisation.localisation_map import FEWEST_POINTS
from evaluation.recognition.auroc import auroc
from evaluation.recognition.pose_errors import (
    SUCCESS_ROTATION_DEG,
    SUCCESS_TRANSLATION,
)
from evaluation.recognition.result_number import Number

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
# Share of the right results whose scores pass the suggested threshold.
_BELIEVED = 0.95
# One row per query: its frame and time; the start's offset in W [m], and its
# turn as a rotation vector in S; errors of the result; scores; standard
# deviations of the result from its covariance [m]; the share of the scan that,
# at the ground-truth pose, has no point of the map within a voxel, NaN if the
# scan has too few points to be aligned; number of steps, and CPU time [s].
QUERY = np.dtype(
    [
        ("frame", "<i8"),
        ("stamp_ns", "<i8"),
        *(
            (name, "<f8")
            for name in (
                "start_x",
                "start_y",
                "start_z",
                "start_turn_x_deg",
                "start_turn_y_deg",
                "start_turn_z_deg",
                "translation_error",
                "rotation_error_deg",
                "along",
                "across",
                "up",
                "own_score",
                "fit",
                "residual",
                "std_along",
                "std_across",
                "std_up",
                "unmapped",
            )
        ),
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


def _believed_threshold(rows: np.ndarray) -> float:
    """Returns the score that 95 % of the right results reach, or NaN."""
    scores = rows["own_score"][is_right(rows)]
    if len(scores) == 0:
        return math.nan
    return float(np.quantile(scores, 1.0 - _BELIEVED, method="lower"))


def summary(rows: np.ndarray) -> dict[str, float | int | None]:
    """Returns a summary of localised scans, for JSON.

    Success rates count all queries; quantiles count only queries with a pose.

    Args:
        rows: (K,) results, records of `QUERY`.
    """
    right = is_right(rows)
    posed = rows[~np.isnan(rows["translation_error"])]

    def quantile(name: str, part: float) -> float | None:
        values = np.abs(posed[name])
        return float(np.quantile(values, part)) if len(values) else None

    least = _believed_threshold(rows)
    believed = rows["own_score"] >= least
    near = is_right(rows, SUCCESS_TRANSLATION, SUCCESS_ROTATION_DEG)
    found: dict[str, float | int | None] = {
        "queries": len(rows),
        "without_pose": len(rows) - len(posed),
        "success_03m_1deg": float(right.mean()),
        "success_2m_5deg": float(near.mean()),
        "translation_median": quantile("translation_error", 0.5),
        "translation_95": quantile("translation_error", 0.95),
        "rotation_median_deg": quantile("rotation_error_deg", 0.5),
        "rotation_95_deg": quantile("rotation_error_deg", 0.95),
    }
    for name in ("along", "across", "up"):
        found[f"{name}_median"] = quantile(name, 0.5)
        found[f"std_{name}_median"] = quantile(f"std_{name}", 0.5)
    # A small residual, or a small deviation, is a high score.
    deviation = np.max(
        [rows[f"std_{name}"] for name in ("along", "across", "up")], axis=0
    )
    for name, scores in (
        ("own_score", rows["own_score"]),
        ("fit", rows["fit"]),
        ("residual", -rows["residual"]),
        ("hessian", -deviation),
    ):
        found[f"auroc_{name}"] = auroc(scores, right)
    found["believed_from"] = least
    # Without a right result, there is no threshold.
    harmful = float((believed & ~right).sum()) if right.any() else math.nan
    wrong = int((~right).sum())
    found["confident_wrong"] = harmful / len(rows)
    found["confident_of_wrong"] = harmful / wrong if wrong else None
    known = rows["unmapped"][~np.isnan(rows["unmapped"])]
    found["unmapped_mean"] = float(known.mean()) if len(known) else None
    found["seconds_mean"] = float(rows["seconds"].mean())
    return json_values(found)


def numbers(rows: np.ndarray, method: str) -> Iterator[Number]:
    """Yields a method's results for `results.csv`, a `Number` for each metric.

    Args:
        rows: (K,) results, records of `QUERY`.
        method: name of the method.
    """
    found = summary(rows)
    for name in _SHOWN:
        if (value := found[name]) is not None:
            yield Number(method, False, name, float(value), n=len(rows))


def columns(rows: np.ndarray) -> dict[str, np.ndarray]:
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
