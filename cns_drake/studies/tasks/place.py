"""Place recognition, and the poses that come with it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from cns_drake.studies.tasks.task import Answers, Jobs, Number, Pair, Task
from evaluation.recognition import metrics
from evaluation.recognition.place_outcome import FAULTS, PlaceOutcome
from evaluation.recognition.pose_errors import pose_success
from evaluation.recognition.survival import kept_share
from evaluation.study.parts import Part
from evaluation.study.place_outcomes import measure_places

# Expected seconds to describe a pair and to compare it by all methods.
_COST = 60.0

Outcomes = Sequence[PlaceOutcome]


class PlaceTask(Task):
    """Which place of the database a query shows."""

    name = "place"
    headline = "auc"
    asks = True

    def measure(self, pair: Pair, jobs: Jobs) -> Part:
        needs: list[str] = []
        arguments = (
            jobs.described(pair.database, "places", pair.protocol, needs),
            jobs.described(pair.query, "queries", pair.protocol, needs),
            jobs.elsewhere(pair, needs),
            pair.distractors,
            jobs.methods,
            pair.protocol,
        )
        part = jobs.files.part("place", pair.name)
        return jobs.add(part, measure_places, arguments, needs, _COST)

    def numbers(
        self, found: Outcomes, before: Outcomes | None
    ) -> Iterator[Number]:
        for now in found:
            for name, value, interval in place_numbers(now, _same(before, now)):
                number = len(now.outcomes)
                yield Number(
                    now.method, now.is_gated, name, value, interval, number
                )

    def answers(self, found: Outcomes) -> Iterator[Answers]:
        for now in found:
            outcomes = now.outcomes
            yield Answers(
                now.method,
                now.is_gated,
                {
                    "query_frame": now.query_frames,
                    "query_stamp_ns": now.stamps_ns,
                    "query_x": now.p_WQs[:, 0],
                    "query_y": now.p_WQs[:, 1],
                    "query_z": now.p_WQs[:, 2],
                    "block": outcomes.blocks
                    if outcomes.blocks is not None
                    else np.arange(len(outcomes)),
                    "correct": outcomes.is_right,
                    "has_match": outcomes.has_match,
                    "score": outcomes.best_scores,
                    "first_right_rank": outcomes.known_ranks,
                    "why": now.faults(),
                    "match_drive": now.match_drives,
                    "match_frame": [
                        one if one >= 0 else None
                        for one in now.match_frames.tolist()
                    ],
                    "distance": now.distances,
                    "translation_error": now.pose_errors.translation,
                    "rotation_error_deg": now.pose_errors.rotation_deg,
                    "overlap": now.overlaps,
                    "visible_change": 1.0 - now.overlaps,
                },
            )


class PoseTask(PlaceTask):
    """Where a query lies, by the method's own pose beside its best place."""

    name = "pose"
    headline = "pose_success"

    def numbers(
        self, found: Outcomes, before: Outcomes | None
    ) -> Iterator[Number]:
        for now in found:
            value = pose_success(now.pose_errors, now.outcomes)
            if np.isnan(value):
                continue
            with_match = int(now.outcomes.has_match.sum())
            values = {"pose_success": value}
            then = _same(before, now)
            if then is not None:
                today = pose_success(then.pose_errors, then.outcomes)
                values["kept"] = float(kept_share(value, today))
            known = ~np.isnan(now.pose_errors.translation)
            if known.any():
                errors = now.pose_errors
                values |= {
                    "translation_median": float(
                        np.median(errors.translation[known])
                    ),
                    "rotation_median_deg": float(
                        np.median(errors.rotation_deg[known])
                    ),
                }
            for name, one in values.items():
                yield Number(now.method, now.is_gated, name, one, n=with_match)

    def answers(self, found: Outcomes) -> Iterable[Answers]:
        # Those of `place` have the errors of poses.
        return ()


def _same(before: Outcomes | None, now: PlaceOutcome) -> PlaceOutcome | None:
    """Returns the outcome of the same method and gate."""
    for one in before or ():
        if (one.method, one.is_gated) == (now.method, now.is_gated):
            return one
    return None


def place_numbers(
    now: PlaceOutcome, before: PlaceOutcome | None
) -> Iterator[tuple[str, float, metrics.Interval]]:
    """Yields name, value and 95 % interval of the numbers of a method.

    Intervals are by bootstrap over blocks of the route; a sample has the same
    ones in the baseline.

    Args:
        now: its outcome in a condition.
        before: its outcome in the baseline, for what is kept, lost and found.
    """
    outcomes = now.outcomes
    curve = metrics.pr_curve(outcomes)
    with_match = int(outcomes.has_match.sum())
    strict = curve.strict_auc(with_match)
    weights = metrics.resampled_weights(len(outcomes), blocks=outcomes.blocks)
    areas, recalls, stricts = metrics.resampled_metrics(outcomes, weights)
    interval = metrics.percentile_interval
    yield "auc", curve.auc, interval(areas)
    yield "auc_strict", strict, interval(stricts)
    yield "r1", outcomes.recall_at(1), interval(recalls)
    if before is not None:
        then = metrics.pr_curve(before.outcomes)
        strict_then = then.strict_auc(int(before.outcomes.has_match.sum()))
        shares = [metrics.UNKNOWN] * 2
        if is_paired := len(before.outcomes) == len(outcomes):
            drawn = metrics.resampled_metrics(before.outcomes, weights)
            drawn_auc, _, drawn_strict = drawn
            shares = [
                interval(kept_share(one, other))
                for one, other in (
                    (areas, drawn_auc),
                    (stricts, drawn_strict),
                )
            ]
        yield "kept", float(kept_share(curve.auc, then.auc)), shares[0]
        yield "kept_strict", float(kept_share(strict, strict_then)), shares[1]
        if is_paired:
            right, was = outcomes.is_right, before.outcomes.is_right
            yield "lost", float((was & ~right).sum()), metrics.UNKNOWN
            yield "found", float((right & ~was).sum()), metrics.UNKNOWN
    yield "with_match", float(with_match), metrics.UNKNOWN
    yield "places", float(outcomes.num_places), metrics.UNKNOWN
    why = now.faults()
    for name in FAULTS:
        yield name, float(why.count(name)), metrics.UNKNOWN
    yield "hidden", float(now.num_hidden), metrics.UNKNOWN
    known = now.overlaps[~np.isnan(now.overlaps)]
    if len(known):
        yield "visible_change", 1.0 - float(known.mean()), metrics.UNKNOWN
