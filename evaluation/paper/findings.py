"""The paper's findings, and whether the results of a study confirm them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from evaluation.paper.best_methods import (
    RING,
    best_methods,
    best_with_all_queries,
    listed_counts,
)
from evaluation.paper.paper_values import KAIST, Measured, StagePair, paper
from evaluation.results import LEAST_POINTS, in_table_order, listed, title

_SIGNIFICANCE = 0.05
# Verdicts on a finding.
HOLDS = "holds"
IN_PART = "holds in part"
FAILS = "does not hold"
UNDECIDED = "cannot be judged"
FITTED = "was fitted"
_BOTH = "Tables I and II"


@dataclass(frozen=True)
class Finding:
    """A claim of the paper, and whether the numbers of a study confirm it.

    Attributes:
        claim: the claim in words.
        verdict: whether the claim is confirmed, in a word or two.
        evidence: the numbers behind the verdict, in words.
        table: table or figure of the paper that makes the claim; may be empty.
    """

    claim: str
    verdict: str
    evidence: str
    table: str = ""


@dataclass(frozen=True)
class Trend:
    """How the AUC of a method depends on the change (TCR_sym), over some pairs.

    Attributes:
        rho: Spearman's rank correlation; NaN if AUC or TCR_sym is constant.
        p_value: two-sided p-value of `rho` under the hypothesis of no
            correlation.
        slope: change of AUC per 0.1 of TCR_sym, by the least-squares line.
        spread: greatest minus least AUC.
        num_pairs: number of pairs of drives.
    """

    rho: float
    p_value: float
    slope: float
    spread: float
    num_pairs: int

    @property
    def falls(self) -> bool:
        """Whether the correlation is negative and significant."""
        return self.rho < 0.0 and self.p_value < _SIGNIFICANCE


def findings(
    results: Sequence[Measured], changes: Mapping[StagePair, float]
) -> list[Finding]:
    """Returns a verdict on each of the paper's findings that can be tested.

    A finding can be tested if `results` and `changes` contain the data on this
    finding. Only results on the paper's maps, with the paper's methods and
    protocol, count. For the other tables of a page, the first result of a
    method on a pair counts.

    Args:
        results: results of place recognition by all protocols.
        changes: (map, stage, other stage) -> TCR_sym; each pair of stages is
            contained in both orders.
    """
    shown = {
        (*r.pair, r.method): r
        for r in reversed(results)
        if r.pair[0] in paper().city_names and r.method in paper().modes
    }
    results = [r for r in results if paper().is_comparable(r)]
    tcr = {
        pair: value
        for pair, value in changes.items()
        if pair[0] in paper().city_names
    }
    methods = in_table_order(result.method for result in results)
    found = []
    if tcr:
        found.append(_larger_than_real(tcr))
    if "ring++" in methods and len(methods) > 1:
        found.append(_ring_is_best(results, [*shown.values()][::-1]))
    known = [r for r in results if not np.isnan(tcr.get(r.pair, np.nan))]
    if known:
        trends = _trends(known, tcr, methods)
        number = len({result.pair for result in known})
        too_few = (
            f"{number} pair{'s' if number > 1 else ''} of drives;"
            f" a trend needs {LEAST_POINTS} or more."
        )
        found.append(_falls(trends, too_few))
        if "btc" in methods and len(methods) > 1:
            found.append(_btc_is_flat(trends, too_few))
    return found


def trend(change: Sequence[float], auc: Sequence[float]) -> Trend:
    """Returns the correlation and slope of AUC over TCR_sym.

    At least three pairs of drives are needed.

    Args:
        change: TCR_sym of each pair.
        auc: AUC of each pair.
    """
    x, y = np.asarray(change), np.asarray(auc)
    spread = float(np.ptp(y))
    if np.ptp(x) == 0.0 or spread == 0.0:
        return Trend(np.nan, np.nan, 0.0, spread, len(x))
    # Slow to import, and not needed by the processes of jobs.
    from scipy.stats import linregress, spearmanr

    rank = spearmanr(x, y)
    return Trend(
        rho=float(rank.statistic),
        p_value=float(rank.pvalue),
        slope=0.1 * float(linregress(x, y).slope),
        spread=spread,
        num_pairs=len(x),
    )


def paper_trend(method: str) -> Trend:
    """Returns the trend of a method's AUC over TCR_sym, as published.

    The AUC values are from the paper's Table II.
    """
    return trend(*zip(*paper().auc_over_change(method), strict=True))


def _trends(
    results: Sequence[Measured],
    tcr: Mapping[StagePair, float],
    methods: Sequence[str],
) -> dict[str, Trend]:
    """Returns the trend of each method (mode all) that has enough pairs."""
    trends = {}
    for method in methods:
        points = [
            (tcr[r.pair], r.by_mode["all"].auc)
            for r in results
            if r.method == method
        ]
        if len(points) >= LEAST_POINTS:
            trends[method] = trend(*zip(*points, strict=True))
    return trends


def _larger_than_real(changes: Mapping[StagePair, float]) -> Finding:
    real = paper().changes[KAIST]
    ours = _first_to_last(
        (name, first, value)
        for (name, first, last), value in changes.items()
        if first < last
    )
    theirs = _first_to_last(
        (name, first, value)
        for (name, first, _), value in paper().changes.items()
        if name != KAIST[0]
    )
    reached = [name for name, value in ours.items() if value >= real]
    values = ", ".join(f"{name} {value:.4f}" for name, value in ours.items())
    published = listed(
        f"{name.capitalize()} ({value:.4f})"
        for name, value in theirs.items()
        if value >= real
    )
    return Finding(
        f"The change meets or surpasses that of four years at KAIST"
        f" ({real:.4f}).",
        FITTED,
        f"TCR_sym between the first and the last stage: {values}. Cities"
        f" in which it reaches KAIST's: {len(reached)} of {len(ours)}. They"
        " were fitted to the paper's values, which reach KAIST's only in"
        f" {published}.",
        "Table I",
    )


def _first_to_last(
    changes: Iterable[tuple[str, str, float]],
) -> dict[str, float]:
    """Returns TCR_sym between the first and the last stage of each map.

    Args:
        changes: (map, earlier stage, TCR_sym) of pairs whose later stage is the
            map's last, as in the paper's Table I and in
            `evaluation.study.recordings.map_drives.MapDrives.change_pairs`.
    """
    found: dict[str, tuple[str, float]] = {}
    for name, stage, value in changes:
        if name not in found or stage < found[name][0]:
            found[name] = stage, value
    return {name: value for name, (_, value) in found.items()}


def _ring_is_best(
    results: Sequence[Measured], shown: Sequence[Measured]
) -> Finding:
    best = best_methods(results)
    evidence = (
        "In the table beside the paper's numbers (protocol paper), the paper's"
        f" method with the greatest AUC on {len(best)} pairs is"
        f" {listed_counts(best)}. {best_with_all_queries(results)}"
    )
    asked = shown[0].protocol
    if asked != "paper":
        words = f"With the protocol {asked}, as in the other tables"
        evidence += f" {best_with_all_queries(shown, words)}"
    return Finding(
        "RING++ is the best of the paper's methods on every pair, as the paper"
        " counts.",
        _share_verdict(sum(RING in methods for methods in best), len(best)),
        evidence,
        "Table II",
    )


def _falls(trends: Mapping[str, Trend], too_few: str) -> Finding:
    claim = (
        "Place recognition gets worse as TCR_sym grows (for BTC the paper"
        " says it does not)."
    )
    # The wording is the same for all methods; the paper itself makes an
    # exception for BTC.
    falls = [trend.falls for name, trend in trends.items() if name != "btc"]
    if not falls:
        return Finding(claim, UNDECIDED, too_few)
    parts = []
    for method, ours in trends.items():
        theirs = paper_trend(method)
        parts.append(
            f"{title(method)} {ours.rho:+.2f} (p = {ours.p_value:.2f},"
            f" {ours.slope:+.3f} AUC for 0.1), in the paper's table"
            f" {theirs.rho:+.2f} (p = {theirs.p_value:.2f},"
            f" {theirs.slope:+.3f})"
        )
    evidence = (
        "Rank correlation of AUC (mode all) with TCR_sym over"
        f" {next(iter(trends.values())).num_pairs} pairs: {'; '.join(parts)}."
    )
    return Finding(
        claim, _share_verdict(sum(falls), len(falls)), evidence, _BOTH
    )


def _btc_is_flat(trends: Mapping[str, Trend], too_few: str) -> Finding:
    claim = "BTC hardly depends on TCR_sym."
    if "btc" not in trends:
        return Finding(claim, UNDECIDED, too_few)
    btc = trends["btc"]
    flattest = min(trends, key=lambda m: abs(trends[m].slope))
    verdict = FAILS
    if not btc.falls:
        verdict = HOLDS if flattest == "btc" else IN_PART
    spreads = ", ".join(f"{title(m)} {t.spread:.3f}" for m, t in trends.items())
    return Finding(
        claim,
        verdict,
        f"Slope {btc.slope:+.3f} AUC for 0.1 of TCR_sym (rank correlation"
        f" {btc.rho:+.2f}, p = {btc.p_value:.2f}); the flattest is"
        f" {title(flattest)}. Greatest less least AUC: {spreads}.",
        _BOTH,
    )


def _share_verdict(number: int, total: int) -> str:
    if number == total:
        return HOLDS
    return IN_PART if number else FAILS
