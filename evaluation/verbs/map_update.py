"""The verb `map-update`: how well changes between two maps are labelled."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evaluation.base import InputError, Reporter, json_values, no_such, one_line
from evaluation.map_update import (
    BASELINES,
    GIVEN,
    PairLabels,
    read_pair,
    score_methods,
)
from evaluation.recognition import numbers_of
from evaluation.results import QueryRows, Results
from evaluation.verbs.measured import Measured, pair_key, rows_of


@dataclass(frozen=True, eq=False)
class MapUpdate(Measured):
    """How well the changes between two maps are labelled.

    Attributes:
        method: name of the change detector, or `labels`.
        scores: all scores, also by class and by distance, ready for JSON.
        labels: the labels of both maps.
    """

    method: str
    scores: dict[str, Any]
    labels: PairLabels

    def to_json(self) -> dict[str, Any]:
        """Returns what `cns-eval map-update --json` prints."""
        return json_values(
            {"method": self.method, **self.scores, **self.metrics}
        )


def update_map(
    folder: Path | str,
    *,
    baseline: str = "free-space",
    labels: tuple[Path, Path] | None = None,
) -> MapUpdate:
    """Scores labels of the changes between two maps, as `map-update` does.

    Args:
        folder: folder with the maps and their ground truth.
        baseline: change detector that labels the maps: `free-space`, `distance`
            or `m3c2`.
        labels: files with labels of your own, of the older and of the newer
            map, which are scored instead.

    Raises:
        InputError: the folder or a file cannot be read, or the detector cannot
            run.

    Example:
        from evaluation import update_map

        print(update_map("maps", baseline="distance").metrics["miou"])
    """
    if baseline not in BASELINES:
        fault = no_such("baseline", baseline, BASELINES)
        raise InputError(f"baseline: {fault}")
    folder = Path(folder)
    sessions = read_pair(folder)
    method = baseline if labels is None else GIVEN
    methods = (baseline,) if labels is None else ()
    found = score_methods(Reporter(), folder, methods, labels or ())[method]
    numbers = [*numbers_of("map", found, method=method)]
    key = pair_key(
        "map-update",
        one_line(folder.resolve().name),
        (sessions.A.folder.name, sessions.B.folder.name),
        "map",
    )
    return MapUpdate(
        {one.metric: one for one in numbers},
        Results.of(rows_of(numbers, key)),
        QueryRows.of(()),
        method,
        found.scores,
        found.labels,
    )
