"""Results of localised scans: a record for each, their metrics, and tables."""

from dataclasses import dataclass
from functools import cached_property
import math
from pathlib import Path

import numpy as np

from evaluation.base import write_csv
from evaluation.clouds import OnNote
from evaluation.localisation.localisation_map import FEWEST_POINTS
from evaluation.recognition import auroc

# Results with errors of at most these are right [m, deg].
RIGHT_TRANSLATION = 0.3
RIGHT_ROTATION_DEG = 1.0
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


@dataclass(frozen=True, eq=False)
class Localised:
    """Localised scans, from which the metrics of the task `localise` follow.

    Success rates count all queries; errors are those of queries with a pose.

    Attributes:
        rows: (K,) results, records of `QUERY`.
    """

    rows: np.ndarray

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def without_pose(self) -> int:
        """Number of queries without a pose."""
        return int(np.isnan(self.rows["translation_error"]).sum())

    def share_within(self, translation: float, rotation_deg: float) -> float:
        """Returns the share of the queries with errors of at most these."""
        return float(is_right(self.rows, translation, rotation_deg).mean())

    @property
    def success(self) -> float:
        """Share of the queries whose pose is right."""
        return self.share_within(RIGHT_TRANSLATION, RIGHT_ROTATION_DEG)

    @property
    def num_matched(self) -> int:
        """Number of queries; each is where the map is."""
        return len(self)

    @property
    def num_poses(self) -> int:
        """Number of queries with a pose."""
        return len(self) - self.without_pose

    def pose_error(self, name: str, part: float) -> float:
        """Returns a quantile of the absolute values of a field.

        Only queries with a pose count; it is NaN without one.
        """
        is_posed = ~np.isnan(self.rows["translation_error"])
        values = np.abs(self.rows[name][is_posed])
        return float(np.quantile(values, part)) if len(values) else math.nan

    def auroc(self, name: str) -> float:
        """Returns how well a score tells right from wrong results (AUROC).

        Args:
            name: `own_score`, `fit`, `residual`, or `hessian`, which is the
                deviation that the estimator states. A small residual, or a
                small deviation, is a high score.
        """
        if name == "hessian":
            stated = [self.rows[f"std_{way}"] for way in _DIRECTIONS]
            scores = -np.max(stated, axis=0)
        else:
            scores = self.rows[name] * (-1.0 if name == "residual" else 1.0)
        return auroc(scores, is_right(self.rows))

    @cached_property
    def believed_from(self) -> float:
        """Score that a share `_BELIEVED` of the right results reaches.

        It is NaN without a right result.
        """
        scores = self.rows["own_score"][is_right(self.rows)]
        if not len(scores):
            return math.nan
        return float(np.quantile(scores, 1.0 - _BELIEVED, method="lower"))

    @property
    def _num_confident_wrong(self) -> float:
        """Number of wrong results that pass the threshold; NaN without one."""
        if math.isnan(self.believed_from):
            return math.nan
        passes = self.rows["own_score"] >= self.believed_from
        return float((passes & ~is_right(self.rows)).sum())

    @property
    def confident_wrong(self) -> float:
        """Wrong results that pass the threshold, as a share of all results."""
        return self._num_confident_wrong / len(self)

    @property
    def confident_of_wrong(self) -> float:
        """Wrong results that pass the threshold, as a share of the wrong."""
        num_wrong = int((~is_right(self.rows)).sum())
        return self._num_confident_wrong / num_wrong if num_wrong else math.nan

    @property
    def unmapped_mean(self) -> float:
        """Mean share of a scan that the map lacks."""
        known = self.rows["unmapped"][~np.isnan(self.rows["unmapped"])]
        return float(known.mean()) if len(known) else math.nan


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
