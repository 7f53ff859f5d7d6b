"""Metrics, a family: what each number in a table of results is.

A metric is one entry of this file, or of a file of a user. Tables, rankings,
charts, pages and documents ask it for its words, its range and its direction.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, replace
import inspect
import math
from pathlib import Path
from typing import Any, Literal

import numpy as np

from cns_drake.base import Family, InputError, did_you_mean, errors_at
from evaluation.methods import as_users_code, run_module
from evaluation.recognition.precision_recall import (
    WeightedMetrics,
    pr_curve,
    weighted_metrics,
)
from evaluation.recognition.query_outcomes import QueryOutcomes
from evaluation.recognition.sign_flips import (
    UNKNOWN,
    Interval,
    jackknife_interval,
    leave_one_out,
)

# Sums and quotients of floating-point numbers leave a range by this at most.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Metric:
    """A number that is measured: what it is, and which values it can have.

    Over conditions, each metric is averaged by the arithmetic mean of its
    defined values.

    Attributes:
        name: name in tables and options.
        title: name in words, in charts and pages.
        unit: unit of the values; "" for shares and counts.
        least, greatest: limits of the values.
        is_whole: whether the values are whole numbers, such as counts.
        better: whether more or less is better; "" if neither is.
        over_queries: what a value says, and how it comes from the queries,
            points or structures of a condition.
        undefined: when a value is undefined, an empty cell; "" if never.
        share_of: name of the metric of which this is the retained share, its
            value divided by its value in the baseline; "" for any other metric.
        main_in: tasks whose summary on the page shows the metric.
        grows: whether the values grow with the places of a database. Charts
            then have a logarithmic axis, and summaries contain the exponent of
            the growth.
        compute: returns the value from the outcomes of queries; None if a task
            computes it from something else.
        has_interval: whether blocks of street give the computed values an
            interval. A metric without a least or a greatest value has none.
        file: the user's file that defines the metric; None for a metric of this
            package.

    Example:
        from evaluation import Metric

        drift = Metric("drift", "drift of the map", "m", 0.0, better="less")
    """

    name: str
    title: str
    unit: str = ""
    least: float = -math.inf
    greatest: float = math.inf
    is_whole: bool = False
    better: Literal["more", "less", ""] = ""
    over_queries: str = ""
    undefined: str = ""
    share_of: str = ""
    main_in: Collection[str] = ()
    grows: bool = False
    compute: Callable[[QueryOutcomes], float] | None = None
    has_interval: bool = True
    file: Path | None = None

    @property
    def label(self) -> str:
        """The title with the unit, for axes and heads of columns."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title

    @property
    def range_text(self) -> str:
        """The possible values, in words."""
        if self.least == -math.inf and self.greatest == math.inf:
            return "any number"
        kind = "a whole number" if self.is_whole else "a number"
        if math.isinf(self.greatest):
            return f"{kind} from {self.least:g} on"
        if math.isinf(self.least):
            return f"{kind} up to {self.greatest:g}"
        return f"{kind} from {self.least:g} to {self.greatest:g}"

    def checked(self, value: float) -> float:
        """Returns a value, moved to its limit if rounding put it out of range.

        Args:
            value: the value; NaN if it is undefined.

        Raises:
            InputError: the metric cannot have the value.
        """
        if math.isnan(value):
            return value
        inside = min(max(value, self.least), self.greatest)
        if abs(value - inside) > _ROUNDING or (
            self.is_whole and math.isfinite(value) and value != round(value)
        ):
            raise InputError(
                f"{self.name}: {value:g} cannot be: it is {self.range_text}"
            )
        return value if inside == value else inside

    @property
    def is_resampled(self) -> bool:
        """Whether blocks of street give the values an interval."""
        return self.compute is not None and self.has_interval

    def of(self, outcomes: QueryOutcomes) -> float:
        """Returns the value of the outcomes of queries.

        Raises:
            InputError: a user's file computes something else than a number
                that the metric can have.
        """
        value = self._computed(outcomes)
        if self.file is not None and math.isnan(value) and not self.undefined:
            raise InputError(
                f"{self.file}: {self.name}: the value is undefined (NaN); say"
                " when that is in `undefined`"
            )
        return value

    def _computed(self, outcomes: QueryOutcomes) -> float:
        """Returns the value of all queries, or of a sample of them."""
        assert self.compute is not None
        if self.file is None:
            return self.compute(outcomes)
        value = self.compute(outcomes.read_only())
        with errors_at(str(self.file)):
            array = np.asarray(value)
            if array.shape or array.dtype.kind not in "biuf":
                shown = f"an array of shape {array.shape}"
                raise InputError(
                    f"{self.name}: {shown if array.shape else repr(value)} is"
                    " no number"
                )
            return self.checked(float(array))

    def weighted(
        self, outcomes: QueryOutcomes, weights: np.ndarray
    ) -> np.ndarray:
        """Returns the values (B,) of B weighted sets of queries.

        Args:
            outcomes: the outcomes of Q queries.
            weights: (B, Q) how often each query is in each set.
        """
        if self.name in WeightedMetrics._fields:
            return getattr(weighted_metrics(outcomes, weights), self.name)
        every = np.arange(len(outcomes))
        return np.array(
            [
                self._computed(outcomes.subset(np.repeat(every, n)))
                for n in weights.astype(np.int64)
            ]
        )

    def without_blocks(
        self, outcomes: QueryOutcomes
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns the values (N,) without each of N blocks, and their weights.

        The weight of a block is its number of queries; only queries with a
        match count if the value depends only on these.
        """
        left = leave_one_out(outcomes)
        values = self.weighted(outcomes, left)
        matched = outcomes.subset(outcomes.has_match)
        counts = np.ones(len(outcomes), dtype=bool)
        if len(matched) and self._computed(matched) == self.of(outcomes):
            counts = outcomes.has_match
        return values, (1.0 - left) @ counts

    def interval(self, outcomes: QueryOutcomes) -> Interval:
        """Returns the 95 % interval of the value, see `jackknife_interval`.

        It is unknown if the metric has no least or no greatest value.
        """
        ends = self.least, self.greatest
        if not self.is_resampled or not np.isfinite(ends).all():
            return UNKNOWN
        values, weights = self.without_blocks(outcomes)
        return jackknife_interval(self.of(outcomes), values, weights, ends)


def _metric(name: str, title: str, unit: str = "", **fields: Any) -> Metric:
    return Metric(name, title, unit, **fields)


def _share(name: str, title: str, **fields: Any) -> Metric:
    """Returns a metric from 0 to 1, of which more is better."""
    usual: dict[str, Any] = {"least": 0.0, "greatest": 1.0, "better": "more"}
    return _metric(name, title, **usual | fields)


def _count(name: str, title: str, **fields: Any) -> Metric:
    usual: dict[str, Any] = {"least": 0.0, "is_whole": True}
    return _metric(name, title, **usual | fields)


def _amount(name: str, title: str, unit: str, **fields: Any) -> Metric:
    """Returns a metric from 0 on, of which less is better."""
    usual: dict[str, Any] = {"least": 0.0, "better": "less"}
    return _metric(name, title, unit, **usual | fields)


def _retained(name: str, of: str, title: str, **fields: Any) -> Metric:
    """Returns the share of another metric that is left of its baseline."""
    usual: dict[str, Any] = {
        "least": 0.0,
        "better": "more",
        "share_of": of,
        "over_queries": "the value, divided by its value in the baseline",
        "undefined": "in the baseline, the value is 0 or undefined",
    }
    return _metric(name, title, **usual | fields)


_NO_MATCH = "no query has a match"
_NO_POSE = "the method estimates no pose"
_MAIN_PLACE = ("place",)


def _shipped() -> Iterator[Metric]:
    """Yields the metrics of this package, in the order of pages."""
    # Place recognition.
    yield _share(
        "auc",
        "AUC",
        over_queries="area under the precision-recall curve",
        main_in=_MAIN_PLACE,
        compute=lambda outcomes: pr_curve(outcomes).auc,
    )
    yield _share(
        "auc_strict",
        "AUC strict",
        over_queries="area under the curve in which every query with a match"
        " counts",
        main_in=_MAIN_PLACE,
        compute=lambda outcomes: pr_curve(outcomes).strict_auc(
            int(outcomes.has_match.sum())
        ),
    )
    yield _share(
        "r1",
        "R@1",
        over_queries="share of the queries with a match",
        undefined=_NO_MATCH,
        main_in=_MAIN_PLACE,
        compute=lambda outcomes: outcomes.recall_at(1),
    )
    # Shares of right poses, and what is left of all of these.
    yield _share(
        "pose_success",
        "pose success",
        over_queries="share of the queries with a match whose pose is within"
        " 2 m and 5 deg",
        undefined=f"{_NO_MATCH}, or {_NO_POSE}",
        main_in=("pose",),
    )
    for name, title in (
        ("success_03m_1deg", "success within 0.3 m and 1 deg"),
        ("success_2m_5deg", "success within 2 m and 5 deg"),
    ):
        yield _share(
            name,
            title,
            over_queries="share of the queries whose pose is so accurate",
            main_in=("localise",),
        )
    yield _retained("relative_auc", "auc", "relative AUC", main_in=_MAIN_PLACE)
    yield _retained(
        "relative_auc_strict",
        "auc_strict",
        "relative AUC strict",
        main_in=_MAIN_PLACE,
    )
    yield _retained("relative_r1", "r1", "relative R@1")
    yield _retained(
        "relative_success",
        "pose_success",
        "relative success rate",
        main_in=("pose", "localise"),
    )
    yield _count(
        "lost",
        "answers lost",
        better="less",
        over_queries="number of queries that are right in the baseline and"
        " wrong in the condition",
    )
    yield _count(
        "found",
        "answers gained",
        better="more",
        over_queries="number of queries that are wrong in the baseline and"
        " right in the condition",
    )
    yield _count(
        "with_match",
        "queries with a match",
        over_queries="number of queries that have a true match",
        compute=lambda outcomes: float(outcomes.has_match.sum()),
        has_interval=False,
    )
    yield _count(
        "places",
        "places",
        over_queries="number of places in the database",
        # 0 stands for unknown, where only the answers are known.
        compute=lambda outcomes: float(outcomes.num_places or math.nan),
        has_interval=False,
    )
    yield _share(
        "recall_at_full_precision",
        "recall at full precision",
        over_queries="greatest recall at which no accepted place is wrong",
        compute=lambda outcomes: pr_curve(outcomes).recall_at_full_precision,
        has_interval=False,
    )
    for name, title in (
        ("no_place", "queries without a match"),
        ("no_candidate", "queries without a candidate"),
        ("other_city", "answers in another city"),
        ("near_miss", "answers just too far"),
        ("elsewhere", "answers elsewhere"),
    ):
        yield _count(
            name,
            title,
            better="less",
            over_queries="number of queries whose top-ranked place is wrong for"
            " this reason",
        )
    yield _count(
        "hidden",
        "wrong answers with little overlap",
        over_queries="number of wrong answers where no match shows half of the"
        " query's scan",
    )
    for name, title, shown in (
        ("visible_change", "visible change", ""),
        (
            "visible_change_added",
            "visible change without parallax",
            ", minus the mean in the baseline",
        ),
    ):
        yield _metric(
            name,
            title,
            least=-1.0,
            greatest=1.0,
            over_queries="mean share of a query's scan that the best of its"
            f" matches does not show{shown}",
            undefined=_NO_MATCH,
        )
    # Poses.
    yield _amount(
        "translation_median",
        "median error of the position",
        "m",
        over_queries="median over the poses; in the task `pose`, over the right"
        " answers that F1max counts",
        undefined="there is no pose",
        main_in=("pose",),
    )
    yield _amount(
        "translation_95",
        "95 % quantile of the error of the position",
        "m",
        over_queries="95 % quantile over the poses",
        undefined="there is no pose",
    )
    yield _amount(
        "rotation_median_deg",
        "median error of the orientation",
        "deg",
        over_queries="median over the poses; in the task `pose`, over the right"
        " answers that F1max counts",
        undefined="there is no pose",
    )
    # Localisation.
    yield _share(
        "auroc_own_score",
        "AUROC of the estimator's score",
        over_queries="probability that a right pose scores above a wrong one",
        undefined="all poses are right, or all wrong",
    )
    yield _share(
        "within_03m",
        "share of the way within 0.3 m",
        over_queries="share of the length of the drive",
        undefined="the drive has no length",
    )
    yield _amount(
        "lost_per_km",
        "losses of the track",
        "1/km",
        over_queries="number, divided by the length of the drive",
        undefined="the drive has no length",
    )
    # Map update.
    yield _share(
        "miou",
        "mean IoU",
        over_queries="mean over the labels that occur",
        undefined="no label occurs",
        main_in=("map",),
    )
    for name in ("kept", "gone", "new", "unobserved"):
        yield _share(
            f"iou_{name}",
            f"IoU of {name}",
            over_queries="intersection over union of points",
            undefined="no point has the label",
        )
    for name in ("gone", "new"):
        for kind in ("precision", "recall"):
            yield _share(
                f"{kind}_{name}",
                f"{kind} of {name}",
                over_queries="share of points",
                undefined="there is no such point",
            )
    yield _share(
        "right_structures",
        "structures with the right verdict",
        over_queries="share of the observed structures that get the right label"
        " (kept, gone or new)",
        undefined="no structure changed",
        main_in=("map",),
    )
    for name, title, of in (
        ("called_structures", "structures called changed", "structures"),
        ("called_points", "points called changed", "points"),
    ):
        yield _share(
            name,
            title,
            better="",
            over_queries=f"share of the {of} that are called gone or new",
            undefined=f"there are no {of}",
            main_in=("map",) if of == "structures" else (),
        )
    for name in ("gone", "new"):
        yield _count(
            name, f"points that are {name}", over_queries="number of points"
        )
    # Structural change.
    for name, title, main in (
        ("tcr_sym", "TCR_sym", True),
        ("tcr_sym_masked", "TCR_sym where both drove", True),
        ("tcr_source_to_target", "TCR from first to second", False),
        ("tcr_target_to_source", "TCR from second to first", False),
    ):
        yield _share(
            name,
            title,
            better="",
            over_queries="share of voxels",
            undefined="no voxel lies in the hulls of both maps",
            main_in=("change",) if main else (),
        )
    # Changes that a map of several drives notices.
    for end, where in (("", ""), ("_here", ", of those that the query sees")):
        yield _count(
            f"changed{end}",
            f"changed structures{where}",
            over_queries="number of structures that were added or removed"
            " between the first drive and the query",
        )
        yield _share(
            f"seen{end}",
            f"changes noticed{where}",
            over_queries="share of the changed structures that a drive of the"
            " database notices",
            undefined="no structure changed",
        )
        for name, title in (
            ("delay_median", "median delay of a change"),
            ("delay_95", "95 % quantile of the delay of a change"),
        ):
            yield _amount(
                f"{name}{end}",
                f"{title}{where}",
                "years",
                over_queries="quantile of the time to the drive that notices a"
                " change",
                undefined="no change is noticed",
            )
    # Costs.
    for name, title, unit in (
        ("query_time", "time of a query", "s"),
        ("build_time", "time to build the database", "s"),
        ("memory", "memory of the descriptors", "bytes"),
    ):
        yield _amount(
            name,
            title,
            unit,
            grows=True,
            over_queries="median over the queries"
            if name == "query_time"
            else "of the whole database",
            main_in=("cost",),
        )
    # Real beside simulated scans.
    yield _share(
        "auc_control",
        "AUC of the control",
        better="",
        over_queries="area under the curve of a classifier",
    )


METRICS: Family[Metric] = Family("metric")
for _one in _shipped():
    METRICS.add(_one.name, _one, __name__)


def metric_named(name: str) -> Metric:
    """Returns a metric; one that is not known has any values.

    Tables of other programs can have metrics that are not known here.
    """
    if name in METRICS:
        return METRICS[name]
    return Metric(name, name.replace("_", " "))


def register_metric(
    name: str, title: str = "", unit: str = "", **fields: Any
) -> Callable[[Callable[[QueryOutcomes], float]], Metric]:
    """Returns a decorator that makes a function a metric of place recognition.

    The function gets the outcomes of the queries of a condition, and returns
    the value, or NaN if it is undefined.

    Args:
        name: name of the metric in tables.
        title: name of the metric in words; by default made from `name`.
        unit: unit of the values; "" for shares and counts.
        fields: further attributes of the metric, see `Metric`.

    Raises:
        ValueError: another metric has this name, the name is empty or has
            unprintable characters, or `fields` has something else.

    Example:
        import numpy as np
        from evaluation import register_metric

        @register_metric("median_rank", least=1.0, better="less")
        def median_rank(outcomes):
            return float(np.median(outcomes.first_right_ranks))
    """
    if not (
        isinstance(name, str)
        and name.isprintable()
        and name.strip() == name != ""
    ):
        raise ValueError(f"{name!r} is no name of a metric")
    better = fields.get("better", "")
    if better not in ("more", "less", ""):
        raise ValueError(f"{name}: better: {better!r} is no direction")

    def enter(compute: Callable[[QueryOutcomes], float]) -> Metric:
        metric = _metric(
            name,
            title or name.replace("_", " "),
            unit,
            compute=compute,
            file=Path(inspect.getfile(compute)),
            **fields,
        )
        if metric.least >= metric.greatest:
            raise ValueError(
                f"{name}: least: {metric.least:g} is not below greatest,"
                f" {metric.greatest:g}"
            )
        METRICS.add(name, metric, _source(compute))
        return metric

    return enter


def _source(compute: Callable) -> tuple[str, str]:
    return compute.__module__, compute.__qualname__


def load_metrics(path: Path) -> list[Metric]:
    """Returns the metrics that a user's Python file registers.

    Raises:
        InputError: there is no such file, it fails, or it registers no metric.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    module = run_module(path)
    found = [
        value
        for value in vars(module).values()
        if isinstance(value, Metric)
        and value.compute
        and value.compute.__module__ == module.__name__
    ]
    if not found:
        raise InputError(
            f"{path}: registers no metric; see evaluation.register_metric"
        )
    return [_checked_here(metric, path) for metric in found]


def _checked_here(metric: Metric, path: Path) -> Metric:
    """Returns a metric whose faults name its file."""
    assert metric.compute is not None
    naming = as_users_code(metric.compute, path)
    named = replace(metric, compute=naming, file=path)
    _try(named)
    METRICS.add(metric.name, named, _source(metric.compute))
    return named


def _try(metric: Metric) -> None:
    """Computes a user's metric of made-up outcomes, before any real ones.

    Raises:
        InputError: it fails, or is random.
    """
    right = np.arange(24) % 3 != 0
    outcomes = QueryOutcomes(
        best_scores=np.linspace(0.9, 0.1, 24),
        is_right=right,
        has_match=right | (np.arange(24) % 2 == 0),
        first_right_ranks=np.where(right, 1.0, np.arange(24) + 2.0),
        num_places=30,
        blocks=np.arange(24) // 4,
    )
    first, second = metric.of(outcomes), metric.of(outcomes)
    if not np.array_equal(first, second, equal_nan=True):
        raise InputError(
            f"{metric.file}: {metric.name}: other values of the same outcomes"
            f" ({first:g}, {second:g}); give random numbers a fixed seed"
        )


def choose_metrics(names: Iterable[str]) -> list[Metric]:
    """Returns metrics by their names, and those of Python files.

    Raises:
        InputError: there is no metric of a name, or a file cannot be used.
    """
    found: list[Metric] = []
    for name in names:
        if name.endswith(".py"):
            found += load_metrics(Path(name))
        elif name in METRICS:
            found.append(METRICS[name])
        else:
            raise InputError(
                f"no metric {name!r} (there are: {', '.join(METRICS)})"
                f"{did_you_mean(name, METRICS)}"
            )
    return found
