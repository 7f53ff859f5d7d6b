"""What a report says first: how the methods rank."""

from collections import Counter
from collections.abc import Sequence
import math

import numpy as np

from evaluation.report.rows import OWN, STAGE
from evaluation.results.charts import titled
from evaluation.results.summaries import Ranked, ranking
from evaluation.results.table import Results


def ranked_methods(results: Results) -> tuple[list[Ranked], str]:
    """Returns the methods by their mean AUC with the change, and a headline.

    The means are over the pairs of drives that all methods have; without one
    there are no methods, and the headline says so.
    """
    rows = results.where({STAGE: OWN}, task="place", metric="auc").rows
    ranked, samples = ranking(rows)
    measured = Counter(
        row.but("method") for row in rows if not math.isnan(row.value)
    )
    num_pairs = sum(n == len(ranked) for n in measured.values())
    return ranked, _headline(ranked, samples, num_pairs)


def beside(results: Results) -> dict[str, dict[str, float]]:
    """Returns what stands beside the mean AUC: column -> method -> mean.

    All are shares of the queries with a match, over the pairs that all methods
    have: those whose best place is right; those whose best place is wrong, but
    within two radii; those with a right pose.
    """
    rows = results.where({STAGE: OWN})
    r1, far, matched, pose = (
        {one.method: one.value for one in ranking(some.rows)[0]}
        for some in (
            rows.where(metric=name)
            for name in ("r1", "too_far", "with_match", "pose_success")
        )
    )
    far = {name: far[name] / max(matched[name], 1.0) for name in far}
    return {"R@1": r1, "only too far": far, "right pose": pose}


def _headline(
    ranked: Sequence[Ranked], samples: np.ndarray, num_pairs: int
) -> str:
    if not ranked:
        return "No pair of drives has an AUC of every method to rank."
    over = f"{num_pairs} pairs of drives" if num_pairs > 1 else "one pair"
    best, *others = [(titled(one.method), f"{one.value:.3f}") for one in ranked]
    if not others:
        return f"{best[0]} has a mean AUC of {best[1]} over {over}."
    ties = [name for name, value in others if value == best[1]]
    if ties:
        names = ", ".join([best[0], *ties[:-1]])
        return (
            f"{names} and {ties[-1]} tie at a mean AUC of {best[1]} ({over})."
        )
    text = (
        f"{best[0]} ranks first of {len(ranked)} methods, with a mean AUC of"
        f" {best[1]} over {over}; {others[0][0]} follows with {others[0][1]}."
    )
    if num_pairs == 1:
        return text
    lead = np.percentile(samples[:, 0] - samples[:, 1], 2.5)
    if lead > 0.0:
        return f"{text} Its lead is beyond chance (95 %)."
    return f"{text} With other pairs, the two might change places (95 %)."
