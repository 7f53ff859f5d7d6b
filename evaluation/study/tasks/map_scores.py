"""The part of the task `map` that needs no simulator: scores of labels."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from cns_drake.base import InputError, Reporter
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
from evaluation.recognition import Number
from evaluation.study.tasks.jobs import Jobs
from evaluation.study.tasks.pair import Pair, Result
from evaluation.study.tasks.task import Task, check_positive

# Scores of a detector that go into a table of results: IoUs, precisions and
# recalls by points; shares of the points and of the structures that it calls
# gone or new; and share of the structures whose verdict is right.
_SCORES = (
    "miou",
    *(f"iou_{name}" for name in ("kept", "gone", "new", "unobserved")),
    *(
        f"{kind}_{name}"
        for name in ("gone", "new")
        for kind in ("precision", "recall")
    ),
    "called_points",
    "called_structures",
    "right_structures",
)
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
                raise InputError(
                    f"{where}: {one!r} is none of {', '.join(known)}"
                )

    def numbers(
        self, found: Mapping[str, MapScores], before: Any | None
    ) -> Iterator[Number]:
        for method, one in found.items():
            number = one.gone + one.new
            values = {name: one.scores[name] for name in _SCORES}
            values |= {"gone": one.gone, "new": one.new}
            for name, value in values.items():
                if value is not None:
                    yield Number(method, False, name, float(value), n=number)


class LabelledMapTask(MapTask):
    """The task `map` on two maps with exact labels in an existing folder."""

    def __init__(
        self, maps: Path, methods: Sequence[str], given: Sequence[Path] = ()
    ):
        """Sets up the task for two maps; their files are not read yet.

        Args:
            maps: folder with the maps of two drives and their exact labels.
            methods: names of change detectors.
            given: files with labels of the older and of the newer map. These
                labels are scored instead of the labels of change detectors.
        """
        super().__init__({}, str(maps))
        self._arguments = maps, tuple(methods), tuple(given)

    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Result, ...]:
        part = jobs.files.part("map", pair.key)
        arguments = self._arguments
        found = jobs.add(part, score_methods, arguments, version=self.version)
        return (found,)


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
