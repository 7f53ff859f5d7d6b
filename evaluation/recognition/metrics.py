"""Metrics, a family: what each number in a table of results is.

A metric is one entry of this file, or of a file of a user. It names the tasks
that have it, and computes its value from the outcomes of such a task. What is
printed, `--json`, tables, rankings, charts, pages and documents ask it for its
value, its words, its range and its direction.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from dataclasses import fields as fields_of
import inspect
import math
from operator import methodcaller
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from evaluation.base import Family, InputError, errors_at, no_such
from evaluation.methods import as_users_code, run_module
from evaluation.recognition.query_outcomes import (
    FAULTS,
    QueryOutcomes,
    WeightedMetrics,
    weighted_metrics,
)
from evaluation.recognition.sign_flips import (
    UNKNOWN,
    Interval,
    jackknife_interval,
    leave_one_out,
)

# Which queries count in the precision-recall curve.
Mode = Literal["all", "filtered"]
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
        tasks: tasks that have the metric.
        compute: returns the value from a task's outcomes: `QueryOutcomes` of
            `place` and `pose`, and the object that any other task describes.
            The value is NaN if it is undefined, and None if the outcomes have
            no such number. Of metrics of other programs, None.
        is_compared: whether `compute` also takes the outcomes of the baseline.
        count: returns from the outcomes the number of queries, points or other
            items from which the value is computed.
        by_mode: whether the mode `filtered` leaves out the queries without a
            match.
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
    tasks: Collection[str] = ("place",)
    compute: Callable[..., float | None] | None = None
    is_compared: bool = False
    count: Callable[[Any], int] = len
    by_mode: bool = False
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
        return (
            self.has_interval
            and self.compute is not None
            and not self.is_compared
            and "place" in self.tasks
        )

    def of(self, outcomes: Any, before: Any = None) -> float:
        """Returns the value of a task's outcomes; NaN if there is none.

        The arguments and errors are those of `value`.
        """
        value = self.value(outcomes, before)
        return math.nan if value is None else value

    def value(self, outcomes: Any, before: Any = None) -> float | None:
        """Returns the value of a task's outcomes.

        Args:
            outcomes: the outcomes.
            before: the outcomes of the baseline, if the metric `is_compared`.

        Returns:
            The value; NaN if it is undefined, and None if the outcomes have no
            such number.

        Raises:
            InputError: a user's file computes something else than a number
                that the metric can have.
        """
        value = self._computed(outcomes, before)
        if (
            self.file is not None
            and not self.undefined
            and (value is None or math.isnan(value))
        ):
            raise InputError(
                f"{self.file}: {self.name}: the value is undefined (NaN); say"
                " when that is in `undefined`"
            )
        return value

    def _computed(self, outcomes: Any, before: Any = None) -> float | None:
        """Returns the value of all outcomes, or of a sample of them."""
        assert self.compute is not None
        if self.file is None:
            given = (outcomes, before) if self.is_compared else (outcomes,)
            return self.compute(*given)
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
        values = [
            self._computed(outcomes.subset(np.repeat(every, n)))
            if n.any()
            else math.nan
            for n in weights.astype(np.int64)
        ]
        return np.array(values, dtype=float)  # None becomes NaN.

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

    def interval(
        self, outcomes: QueryOutcomes, before: QueryOutcomes | None = None
    ) -> Interval:
        """Returns the 95 % interval of the value, see `jackknife_interval`.

        It is unknown if the metric has no least or no greatest value. The
        interval of a retained share is unknown if the queries of the baseline,
        `before`, are others, or the outcomes are the baseline themselves.
        """
        if self.is_compared:
            # A baseline beside itself has nothing to tell.
            if not self.has_interval or before is None or before is outcomes:
                return UNKNOWN
            return _kept_interval(METRICS[self.share_of], outcomes, before)
        ends = self.least, self.greatest
        if not self.is_resampled or not np.isfinite(ends).all():
            return UNKNOWN
        values, weights = self.without_blocks(outcomes)
        return jackknife_interval(self.of(outcomes), values, weights, ends)


def _kept_interval(
    metric: Metric, now: QueryOutcomes, before: QueryOutcomes
) -> Interval:
    """Returns the 95 % interval of a retained share of a metric.

    Without a block, a retained share has the block neither in the condition nor
    in the baseline, in which nothing differs between the drives. The two
    imaginary blocks of `jackknife_interval` are one in which nothing is
    retained, and one in which the metric rises from 0 to 1.
    """
    unchanged = metric.of(before)
    if len(before) != len(now) or not unchanged > 0.0:
        return UNKNOWN
    share = metric.of(now) / unchanged
    values, weights = metric.without_blocks(now)
    then, _ = metric.without_blocks(replace(before, blocks=now.own_blocks))
    ends = 0.0, share + 1.0 / unchanged
    return jackknife_interval(share, kept_share(values, then), weights, ends)


def kept_share(
    changed: np.ndarray | float, unchanged: np.ndarray | float
) -> np.ndarray:
    """Returns `changed` / `unchanged`, NaN where `unchanged` is 0 or NaN.

    If `changed` is a result under a change, and `unchanged` the same result
    without the change, the quotient is the retained share.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.divide(changed, unchanged)
    return np.where(np.asarray(unchanged) > 0.0, share, math.nan)


def numbers_of(
    task: str,
    now: Any,
    before: Any = None,
    *,
    method: str = "",
    verified: bool = False,
    mode: Mode = "all",
) -> Iterator[Number]:
    """Yields the numbers of a task's outcomes, in the order of `METRICS`.

    Args:
        task: name of the task.
        now: its outcomes in a condition, see `Metric.compute`.
        before: its outcomes in the baseline, which can be `now` itself; None to
            leave out the metrics that compare the condition with the baseline.
        method: method, estimator or baseline; "" if there is none.
        verified: whether geometric verification was used.
        mode: `filtered` to leave the queries without a match out of metrics
            that have `by_mode`.

    Raises:
        InputError: a user's metric fails.
    """
    every = now
    if mode == "filtered":
        matched = now.subset(now.has_match)
    for metric in METRICS.values():
        if task not in metric.tasks or (metric.is_compared and before is None):
            continue
        now = matched if mode == "filtered" and metric.by_mode else every
        value = metric.value(now, before)
        if value is None:
            continue
        yield Number(
            method,
            verified,
            metric.name,
            float(value),
            metric.interval(now, before),
            metric.count(now),
        )


def _metric(
    name: str,
    title: str,
    over: str,
    undefined: str = "",
    value: str | Callable[..., Any] = "",
    number: str = "",
    **fields: Any,
) -> Metric:
    """Returns a metric of this package.

    Args:
        name, title, undefined: see `Metric`.
        over: its `over_queries`.
        value: its `compute`, or the path of the attribute of a task's outcomes
            that is the value; by default the attribute with the metric's name.
        number: path of the attribute that is the number of items; by default
            the length of the outcomes.
        fields: further attributes of the metric.
    """
    usual: dict[str, Any] = {
        "compute": value if callable(value) else _attribute(value or name),
        "count": _attribute(number) if number else len,
        "has_interval": False,
    }
    words = {"over_queries": over, "undefined": undefined}
    return Metric(name, title, **usual | words | fields)


def _attribute(path: str) -> Callable[[Any], Any]:
    """Returns a function that returns an attribute of an attribute, or None."""

    def get(found: Any) -> Any:
        for name in path.split("."):
            found = getattr(found, name, None)
        return found

    return get


def _share(*words: Any, **fields: Any) -> Metric:
    """Returns a metric from 0 to 1, of which more is better."""
    usual: dict[str, Any] = {"least": 0.0, "greatest": 1.0, "better": "more"}
    return _metric(*words, **usual | fields)


def _count(*words: Any, **fields: Any) -> Metric:
    usual: dict[str, Any] = {"least": 0.0, "is_whole": True}
    return _metric(*words, **usual | fields)


def _amount(*words: Any, **fields: Any) -> Metric:
    """Returns a metric from 0 on, of which less is better."""
    usual: dict[str, Any] = {"least": 0.0, "better": "less"}
    return _metric(*words, **usual | fields)


def _retained(name: str, of: str, title: str, **fields: Any) -> Metric:
    """Returns the share of another metric that is left of its baseline."""

    def compute(now: Any, before: Any) -> float | None:
        value = METRICS[of].value(now)
        if value is None:
            return None
        return float(kept_share(value, METRICS[of].of(before)))

    over = "the value, divided by its value in the baseline"
    undefined = "in the baseline, the value is 0 or undefined"
    usual: dict[str, Any] = {"least": 0.0, "better": "more", "share_of": of}
    fields = {**usual, "is_compared": True, **fields}
    return _metric(name, title, over, undefined, compute, **fields)


def _visible_change(outcomes: QueryOutcomes) -> float | None:
    """Returns the mean share of a scan that the best match does not show."""
    shown = outcomes.columns.get("overlap")
    return None if shown is None else 1.0 - _mean_of_known(shown)


def _visible_change_added(
    now: QueryOutcomes, before: QueryOutcomes
) -> float | None:
    """Returns the mean visible change minus the mean in a baseline.

    The visible change also contains parts of a scan that are occluded only
    because the viewpoints differ (parallax). Subtracting the baseline removes
    these parts.
    """
    shown, whole = (one.columns.get("overlap") for one in (now, before))
    if shown is None or whole is None or len(before) != len(now):
        return None
    return _mean_of_known(whole - shown)


def _mean_of_known(values: np.ndarray) -> float:
    """Returns the mean of the values that are numbers; NaN without one."""
    known = values[~np.isnan(values)]
    return float(known.mean()) if len(known) else math.nan


def _num_right_only_in(
    these: QueryOutcomes, those: QueryOutcomes
) -> float | None:
    """Returns how many queries some outcomes have right, and others wrong."""
    if len(these) != len(those):
        return None
    return float((these.is_right & ~those.is_right).sum())


_NO_MATCH = "no query has a match"
_NO_POSE = "there is no pose"
_NO_RIGHT = "no pose is right"
_NO_LENGTH = "the drive has no length"
_NO_VOXEL = "no voxel lies in the hulls of both maps"
_PLACE: dict[str, Any] = {"main_in": ("place",)}
_RESAMPLED: dict[str, Any] = {"by_mode": True, "has_interval": True}
_BY_MODE: dict[str, Any] = {"by_mode": True}
_POSE: dict[str, Any] = {"tasks": ("pose",), "number": "num_poses"}
_LOCALISE: dict[str, Any] = {"tasks": ("localise",)}
_LOCALISED = _LOCALISE | {"number": "num_poses"}
_MAP: dict[str, Any] = {"tasks": ("map",), "number": "num_changed"}
_CHANGE: dict[str, Any] = {"tasks": ("change",), "better": ""}


def _of_curve(name: str) -> Callable[[QueryOutcomes], float]:
    """Returns what computes a value of the precision-recall curve.

    Without a match it is NaN: every curve then has recall 0.
    """

    def compute(outcomes: QueryOutcomes) -> float:
        return (
            getattr(outcomes.curve, name) if outcomes.num_matched else math.nan
        )

    return compute


# fmt: off
def _of_answers() -> Iterator[Metric]:
    """Yields the metrics of place recognition."""
    yield _share(
        "auc", "AUC", "area under the precision-recall curve", _NO_MATCH,
        _of_curve("auc"), **_PLACE, **_RESAMPLED)
    yield _share(
        "auc_strict", "AUC strict",
        "area under the curve in which every query with a match counts",
        _NO_MATCH, **_PLACE, **_RESAMPLED)
    yield _share(
        "r1", "R@1", "share of the queries with a match", _NO_MATCH,
        methodcaller("recall_at", 1), **_PLACE, **_RESAMPLED)
    for rank in (5, 10, 25):
        yield _share(
            f"r{rank}", f"R@{rank}",
            "share of the queries with a match among the best N places",
            _NO_MATCH, methodcaller("recall_at", rank), **_RESAMPLED)
    yield _share(
        "r1_percent", "R@1%", "share of the queries with a match among the best"
        " hundredth of the places", _NO_MATCH, "recall_at_1_percent",
        **_RESAMPLED)
    yield _share(
        "mrr", "mean reciprocal rank",
        "mean of 1 / rank of the best match, over the queries with a match",
        _NO_MATCH, "mean_reciprocal_rank", **_RESAMPLED)
    yield _share(
        "f1_max", "F1max", "greatest F1 on the precision-recall curve",
        _NO_MATCH, _of_curve("f1_max"), **_BY_MODE)
    yield _share(
        "recall_at_full_precision", "recall at full precision",
        "greatest recall at which no accepted place is wrong", _NO_MATCH,
        _of_curve("recall_at_full_precision"), **_BY_MODE)
    yield _share(
        "match_auroc", "match AUROC", "probability that a query with a match"
        " has a better best score than a query without a match",
        "all queries have a match, or none")
    for radius in (2.5, 5.0, 7.5, 10.0, 15.0, 20.0, 25.0):
        yield _share(
            f"auc_{radius:g}m", f"AUC within {radius:g} m",
            "AUC with this radius of a match", _NO_MATCH,
            methodcaller("auc_within", radius))
    yield _retained("relative_auc", "auc", "relative AUC",
                    **_PLACE, **_RESAMPLED)
    yield _retained("relative_auc_strict", "auc_strict", "relative AUC strict",
                    **_PLACE, **_RESAMPLED)
    yield _retained("relative_r1", "r1", "relative R@1", **_RESAMPLED)
    yield _count(
        "lost", "answers lost", "number of queries that are right in the"
        " baseline and wrong in the condition", better="less",
        value=lambda now, before: _num_right_only_in(before, now),
        is_compared=True)
    yield _count(
        "found", "answers gained", "number of queries that are wrong in the"
        " baseline and right in the condition", better="more",
        value=_num_right_only_in, is_compared=True)
    yield _count("queries", "queries", "number of queries", value=len,
                 tasks=("place", "localise"))
    yield _count(
        "with_match", "queries with a match",
        "number of queries that have a true match", value="num_matched")
    for name, title, which, by_mode in (
        ("true_positives", "right answers (TP)",
         "whose top-ranked place is a match", False),
        ("f1_max_true_positives", "TP at F1max",
         "whose answer is accepted and right", True),
        ("f1_max_counted", "TP + FP + FN at F1max",
         "that are no true negatives", True),
    ):
        yield _count(name, title, f"number of queries {which}",
                     by_mode=by_mode)
    yield _count("places", "places", "number of places in the database",
                 value=lambda outcomes: outcomes.num_places or None)
    for name, title in zip(FAULTS, (
        "queries without a match", "queries without a candidate",
        "answers in another city", "answers just too far", "answers elsewhere",
    ), strict=True):
        yield _count(
            name, title, "number of queries whose top-ranked place is wrong for"
            " this reason", better="less",
            value=methodcaller("num_wrong_by", name))
    yield _count(
        "hidden", "wrong answers with little overlap",
        "number of wrong answers where no match shows half of the query's scan")
    for name, title, value, more in (
        ("visible_change", "visible change", _visible_change, ""),
        ("visible_change_added", "visible change without parallax",
         _visible_change_added, ", minus the mean in the baseline"),
    ):
        yield _metric(
            name, title, "mean share of a query's scan that the best of its"
            f" matches does not show{more}", _NO_MATCH, value, least=-1.0,
            greatest=1.0, is_compared=bool(more))


def _of_poses() -> Iterator[Metric]:
    """Yields the metrics of poses, at places and in maps."""
    both = ("pose", "localise")
    yield _share(
        "pose_success", "pose success",
        "share of the queries with a match whose pose is within 2 m and 5 deg",
        f"{_NO_MATCH}, or the method estimates no pose", "success",
        "num_matched", tasks=("pose",), main_in=("pose",))
    for name, title, limits in (
        ("success_03m_1deg", "success within 0.3 m and 1 deg", (0.3, 1.0)),
        ("success_2m_5deg", "success within 2 m and 5 deg", (2.0, 5.0)),
    ):
        yield _share(
            name, title, "share of the queries whose pose is so accurate",
            value=methodcaller("share_within", *limits),
            main_in=("localise",), **_LOCALISE)
    yield _retained("relative_success", "pose_success", "relative success rate",
                    number="num_matched", tasks=both, main_in=both)
    for kind, title, unit, end in (
        ("translation", "error of the position", "m", ""),
        ("rotation", "error of the orientation", "deg", "_deg"),
    ):
        column = f"{kind}_error{end}"
        yield _amount(
            f"{kind}_median{end}", f"median {title}", "median over the poses;"
            " in the task `pose`, over the right answers that F1max counts",
            _NO_POSE, methodcaller("pose_error", column, 0.5), unit=unit,
            main_in=() if end else ("pose",), **_POSE | {"tasks": both})
        for part, of, over in (
            (90, _POSE, "right answers that F1max counts"),
            (95, _LOCALISED, "poses"),
        ):
            yield _amount(
                f"{kind}_{part}{end}", f"{part} % quantile of the {title}",
                f"{part} % quantile over the {over}", _NO_POSE,
                methodcaller("pose_error", column, part / 100.0), unit=unit,
                **of)


def _of_localisation() -> Iterator[Metric]:
    """Yields further metrics of scans in a map, and of a tracked drive."""
    for name, way in (("along", "along the car"), ("across", "across the car"),
                      ("up", "of the height")):
        for column, title in (
            (name, f"median error {way}"),
            (f"std_{name}", f"median stated deviation {way}"),
        ):
            yield _amount(
                f"{column}_median", title, "median over the poses", _NO_POSE,
                methodcaller("pose_error", column, 0.5), unit="m",
                **_LOCALISED)
    for name, title in (
        ("own_score", "the estimator's score"), ("fit", "the fit"),
        ("residual", "the residual"), ("hessian", "the stated deviation"),
    ):
        yield _share(
            f"auroc_{name}", f"AUROC of {title}",
            "probability that a right pose scores above a wrong one",
            "all poses are right, or all wrong", methodcaller("auroc", name),
            **_LOCALISE)
    yield _metric("believed_from", "threshold of trust",
                  "score that 95 % of the right poses reach", _NO_RIGHT,
                  **_LOCALISE)
    yield _share(
        "confident_wrong", "wrong, but confident", "share of the queries that"
        " are wrong and reach the threshold of trust", _NO_RIGHT, better="less",
        **_LOCALISE)
    yield _share(
        "confident_of_wrong", "wrong poses that are confident",
        "share of the wrong poses that reach the threshold of trust",
        f"{_NO_RIGHT}, or none is wrong", better="less", **_LOCALISE)
    yield _share(
        "unmapped_mean", "share of a scan that the map lacks",
        "mean over the scans with enough points", "no scan has enough points",
        better="", **_LOCALISE)
    yield _count("without_pose", "scans without a pose", "number of queries",
                 better="less", **_LOCALISE)
    yield _share("within_03m", "share of the way within 0.3 m",
                 "share of the length of the drive", _NO_LENGTH, **_LOCALISE)
    yield _amount(
        "lost_per_km", "losses of the track",
        "number, divided by the length of the drive", _NO_LENGTH, unit="1/km",
        **_LOCALISE)
    for name, title, better in (
        ("losses", "number of losses of the track", "less"),
        ("lost_for_good", "losses without a recovery", "less"),
        ("stretches", "sections of the drive in the map", ""),
    ):
        yield _count(name, title, "number", better=better, **_LOCALISE)
    yield _amount(
        "back_after_median", "way until a recovery",
        "median over the losses with a recovery", "there is none", unit="m",
        **_LOCALISE)
    yield _amount("way", "way in the map", "length of the drive in the map",
                  unit="m", better="", **_LOCALISE)


def _of_maps() -> Iterator[Metric]:
    """Yields the metrics of a change detector's labels."""
    main = {"main_in": ("map",)}
    labels = "mean over the labels that occur", "no label occurs"
    yield _share("miou", "mean IoU", *labels, methodcaller("score", "miou"),
                 **main, **_MAP)
    for name in ("kept", "gone", "new", "unobserved"):
        yield _share(
            f"iou_{name}", f"IoU of {name}",
            "intersection over union of points", "no point has the label",
            methodcaller("score", f"iou_{name}"), **_MAP)
    for keys, title, of in (
        ((), "", "point"),
        (("within_02m",), " within 0.2 m", "point"),
        (("within_05m",), " within 0.5 m", "point"),
        (("by_structure",), " by structure", "structure"),
    ):
        for name in (f"{kind}_{label}" for label in ("gone", "new")
                     for kind in ("precision", "recall")):
            yield _share(
                "_".join((name, *keys)), f"{name.replace('_', ' of ')}{title}",
                f"share of {of}s", f"there is no such {of}",
                methodcaller("score", *keys, name), **_MAP)
    yield _share(
        "right_structures", "structures with the right verdict",
        "share of the observed structures that get the right label (kept, gone"
        " or new)", "no structure changed",
        methodcaller("score", "right_structures"), **main, **_MAP)
    for of, more in (("structures", main), ("points", {})):
        yield _share(
            f"called_{of}", f"{of} called changed",
            f"share of the {of} that are called gone or new",
            f"there are no {of}", methodcaller("score", f"called_{of}"),
            better="", **more, **_MAP)
    yield _share(
        "miou_static", "mean IoU without vehicles and people", *labels,
        methodcaller("score", "without_vehicles_and_people", "miou"), **_MAP)
    for name in ("completeness", "accuracy"):
        yield _share(
            name, f"{name} of the updated map",
            "share of the points within 0.2 m of the other map",
            "a map has no point to compare",
            methodcaller("score", "updated_map", name), **_MAP)
    yield _amount(
        "chamfer", "Chamfer distance of the updated map",
        "mean of the mean distances between the maps",
        "a map has no point to compare",
        methodcaller("score", "updated_map", "chamfer"), unit="m", **_MAP)
    for name in ("gone", "new"):
        yield _count(name, f"points that are {name}", "number of points",
                     **_MAP)


def _of_change() -> Iterator[Metric]:
    """Yields the metrics of structural change."""
    for name, title, value, main in (
        ("tcr_sym", "TCR_sym", "change.symmetric", ("change",)),
        ("tcr_sym_masked", "TCR_sym where both drove", "masked.symmetric",
         ("change",)),
        ("tcr_source_to_target", "TCR from first to second",
         "change.source_to_target.ratio", ()),
        ("tcr_target_to_source", "TCR from second to first",
         "change.target_to_source.ratio", ()),
        ("tcr_sym_no_change", "TCR_sym of only the routes",
         "control.symmetric", ()),
    ):
        yield _share(name, title, "share of voxels", _NO_VOXEL, value,
                     f"{value.rpartition('.')[0]}.num_in_hull", main_in=main,
                     **_CHANGE)
    for name, title, value in (
        ("registered", "TCR_sym after registration", "registered.symmetric"),
        ("least", "least TCR_sym over shifted grids", "spread.least"),
        ("greatest", "greatest TCR_sym over shifted grids", "spread.greatest"),
    ):
        yield _share(f"tcr_sym_{name}", title, "share of voxels", _NO_VOXEL,
                     value, "change.num_in_hull", **_CHANGE)
    yield _metric(
        "registration_yaw_deg", "yaw of the registration",
        "of the frame of the second map in that of the first", "",
        "registered.yaw_deg", "change.num_in_hull", unit="deg", **_CHANGE)
    for name, title in (("in_hull", "voxels in the other map's hull"),
                        ("unchanged", "voxels with a counterpart")):
        yield _count(name, title, "number of voxels of both maps", "",
                     f"change.num_{name}", "change.num_in_hull", **_CHANGE)


def _others() -> Iterator[Metric]:
    """Yields the metrics of sightings of changes, and of costs."""
    for end, where in (("", ""), ("_here", ", of those that the query sees")):
        part = "by_query" if end else "all"
        yield _count(
            f"changed{end}", f"changed structures{where}",
            "number of structures that were added or removed between the first"
            " drive and the query", "", f"{part}.changed", f"{part}.changed",
            tasks=("seen",))
        yield _share(
            f"seen{end}", f"changes noticed{where}", "share of the changed"
            " structures that a drive of the database notices",
            "no structure changed", f"{part}.seen", f"{part}.changed",
            tasks=("seen",))
        for name, title in (
            ("delay_median", "median delay of a change"),
            ("delay_95", "95 % quantile of the delay of a change"),
        ):
            yield _amount(
                f"{name}{end}", f"{title}{where}",
                "quantile of the time to the drive that notices a change",
                "no change is noticed", f"{part}.{name}", f"{part}.num_delays",
                unit="years", tasks=("seen",))
    for name, title, unit, over in (
        ("query_time", "time of a query", "s", "median over the queries"),
        ("build_time", "time to build the database", "s",
         "of the whole database"),
        ("memory", "memory of the descriptors", "bytes",
         "of the whole database"),
    ):
        yield _amount(name, title, over, unit=unit, number="places",
                      grows=True, tasks=("cost",), main_in=("cost",))
# fmt: on


METRICS: Family[Metric] = Family("metric")
for _family in (_of_answers, _of_poses, _of_localisation, _of_maps, _of_change,
                _others):  # fmt: skip
    for _one in _family():
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
    the value, or NaN if it is undefined. From then on the metric is printed,
    and is in tables, rankings and charts.

    Args:
        name: name of the metric in tables.
        title: name of the metric in words; by default made from `name`.
        unit: unit of the values; "" for shares and counts.
        fields: further attributes of the metric, see `Metric`.

    Raises:
        ValueError: another metric has this name, the name is empty or has
            unprintable characters, or `fields` has something else.
        InputError: the function fails for made-up outcomes, or is random.

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
    made_here = ("compute", "file")
    known = [f.name for f in fields_of(Metric) if f.name not in made_here]
    for field in fields:
        if field not in known:
            raise ValueError(f"{name}: {no_such('field', field, known)}")
    better = fields.get("better", "")
    if better not in ("more", "less", ""):
        raise ValueError(f"{name}: better: {better!r} is no direction")

    def enter(compute: Callable[[QueryOutcomes], float]) -> Metric:
        file = Path(inspect.getfile(compute))
        metric = Metric(
            name,
            title or name.replace("_", " "),
            unit,
            compute=as_users_code(compute, file),
            file=file,
            **fields,
        )
        if metric.least >= metric.greatest:
            raise ValueError(
                f"{name}: least: {metric.least:g} is not below greatest,"
                f" {metric.greatest:g}"
            )
        _try(metric)
        METRICS.add(name, metric, (compute.__module__, compute.__qualname__))
        return metric

    return enter


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
    return found


def _try(metric: Metric) -> None:
    """Computes a user's metric of made-up outcomes, before any real ones."""
    right = np.arange(24) % 3 != 0
    outcomes = QueryOutcomes(
        best_scores=np.linspace(0.9, 0.1, 24),
        is_right=right,
        has_match=right | (np.arange(24) % 2 == 0),
        first_right_ranks=np.where(right, 1.0, np.arange(24) + 2.0),
        num_places=30,
        blocks=np.arange(24) // 4,
        columns={
            "query_frame": 10 * np.arange(24),
            "why": np.where(right, "", FAULTS[-1]),
            "distance": np.linspace(1.0, 30.0, 24),
            "nearest": np.ones(24),
            "translation_error": np.linspace(0.0, 5.0, 24),
            "rotation_error_deg": np.linspace(0.0, 10.0, 24),
            "overlap": np.linspace(0.9, 0.1, 24),
        },
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
            raise InputError(no_such("metric", name, METRICS))
    return found


class Number(NamedTuple):
    """A result of a task.

    Attributes:
        method: method, estimator or baseline; "" if there is none. For a place
            recognition method, it is the method's name with its settings.
        verified: whether geometric verification was used.
        metric: name of the metric.
        value: its value.
        interval: its 95 % interval.
        n: number of queries, points or other items from which the value is
            computed.
    """

    method: str
    verified: bool
    metric: str
    value: float
    interval: Interval = UNKNOWN
    n: int = 0
