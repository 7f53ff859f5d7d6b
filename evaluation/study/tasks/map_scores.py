"""The part of the task `map` that needs no simulator: scores of labels."""

from collections.abc import Iterator, Mapping, Sequence
import math
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from evaluation.base import InputError, Reporter, no_such
from evaluation.map_update import (
    BASELINES,
    Label,
    PairLabels,
    SessionPair,
    class_names,
    read_labels,
    read_pair,
    read_truth,
    run_baseline,
    score,
)
from evaluation.recognition import Number, numbers_of
from evaluation.study.tasks.task import Task, check_positive

# Name under which the exact labels are scored, like a method's labels.
TRUTH = "truth"
# Name of labels that the user gives.
GIVEN = "labels"


class MapScores(NamedTuple):
    """The scores of a change detector.

    Attributes:
        scores: name of a score -> its value, see
            `evaluation.map_update.scores.score`.
        gone, new: numbers of points with the exact labels gone and new.
        labels: the detector's labels of both maps.
    """

    scores: dict[str, Any]
    gone: int
    new: int
    labels: PairLabels

    def score(self, *keys: str) -> float:
        """Returns a score by its keys in `scores`; NaN if it is undefined."""
        value: Any = self.scores
        for key in keys:
            value = value[key]
        return math.nan if value is None else float(value)

    @property
    def num_changed(self) -> int:
        """Number of points with the exact label gone or new."""
        return self.gone + self.new


class MapTask(Task):
    """Scores change detectors, which label points as kept, gone or new."""

    name = "map"
    defaults: ClassVar[Mapping[str, Any]] = {"methods": None, "spacing": 5.0}

    def check(self, name: str, value: Any, where: str) -> None:
        if name == "spacing":
            check_positive(value, where)
            return
        known = (TRUTH, *BASELINES)
        for one in value:
            if one not in known:
                raise InputError(f"{where}: {no_such('method', one, known)}")

    def numbers(
        self, found: Mapping[str, MapScores], before: Any | None
    ) -> Iterator[Number]:
        for method, one in found.items():
            yield from numbers_of(self.name, one, method=method)


def score_methods(
    reporter: Reporter,
    maps: Path,
    methods: tuple[str, ...],
    given: tuple[Path, ...] = (),
) -> dict[str, MapScores]:
    """Scores the labels of change detectors against exact labels.

    Args:
        reporter: unused.
        maps: folder with the maps of two drives and their exact labels.
        methods: names of change detectors. The name `TRUTH` scores the exact
            labels themselves.
        given: files with labels of the older and of the newer map. These labels
            are scored under the name `GIVEN`.

    Returns:
        Method -> its scores.

    Raises:
        InputError: the folder cannot be read, or a detector cannot run.
    """
    pair = read_pair(maps)
    truth = read_truth(pair)
    number = {
        "gone": int((truth.A == Label.GONE).sum()),
        "new": int((truth.B == Label.NEW).sum()),
    }
    found = {}
    for method in (*methods, *((GIVEN,) if given else ())):
        labels = _choose_labels(method, pair, truth, given)
        scores = score(pair, truth, labels, class_names(maps))
        found[method] = MapScores(scores, **number, labels=labels)
    return found


def _choose_labels(
    method: str, pair: SessionPair, truth: PairLabels, given: Sequence[Path]
) -> PairLabels:
    """Returns the labels that are scored under the name of a method.

    Args:
        method: name of a change detector, `TRUTH` or `GIVEN`.
        pair: the two maps.
        truth: the exact labels of these maps.
        given: files with the labels for `GIVEN`, of the older and of the newer
            map.

    Raises:
        InputError: a file cannot be read, or the detector cannot run.
    """
    if method == TRUTH:
        return truth
    if method == GIVEN:
        return PairLabels(
            *(
                read_labels(path, session, truth=False)
                for path, session in zip(given, pair, strict=True)
            )
        )
    return run_baseline(method, pair)
