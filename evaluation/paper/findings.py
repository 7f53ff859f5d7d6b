"""Judges the paper's findings by our numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from evaluation.change.drive_change import (
    ChangeResult,
    symmetric_changes,
)
from evaluation.paper import printed_values as printed
from evaluation.recognition.metrics import MODES
from evaluation.recognition.place_recognition import RecognitionResult
from evaluation.report.method_titles import in_table_order, title
from evaluation.report.reference import Finding

# Least number of pairs from which a trend is judged.
_FEWEST_PAIRS = 5
_SIGNIFICANCE = 0.05

HOLDS = "holds"
IN_PART = "holds in part"
FAILS = "does not hold"
UNDECIDED = "cannot be judged"


@dataclass(frozen=True)
class Trend:
    """The trend of AUC over TCR_sym of some pairs.

    Attributes:
        rho: Spearman's rank correlation; NaN if either does not vary.
        p_value: two-sided, of no correlation.
        slope: of the least-squares line, AUC for 0.1 of TCR_sym.
        spread: greatest less least AUC.
        num_pairs: how many.
    """

    rho: float
    p_value: float
    slope: float
    spread: float
    num_pairs: int

    @property
    def falls(self) -> bool:
        return self.rho < 0.0 and self.p_value < _SIGNIFICANCE


def findings(
    results: Sequence[RecognitionResult], changes: Sequence[ChangeResult]
) -> list[Finding]:
    """Judges the paper's findings; findings without data are left out.

    Only the paper's maps and methods are judged by them, and only by its
    protocol.

    Args:
        results: place recognition of all pairs.
        changes: TCR of all pairs.
    """
    results = [r for r in results if printed.is_printed(r)]
    changes = [c for c in changes if c.map_name in printed.city_names()]
    tcr = symmetric_changes(changes)
    methods = in_table_order(result.method for result in results)
    found = []
    if changes:
        found.append(_larger_than_real(changes))
    if "ring++" in methods and len(methods) > 1:
        found.append(_ring_is_best(results))
    known = [r for r in results if not np.isnan(tcr.get(r.pair, np.nan))]
    if known:
        found.append(_falls(known, tcr, methods))
        if "btc" in methods and len(methods) > 1:
            found.append(_btc_is_flat(known, tcr, methods))
    return found


def trend(change: Sequence[float], auc: Sequence[float]) -> Trend:
    """Returns the trend of AUC over TCR_sym, of three pairs or more."""
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
    """Returns the trend in the paper's own Table II."""
    return trend(*zip(*printed.auc_over_change(method), strict=True))


def _larger_than_real(changes: Sequence[ChangeResult]) -> Finding:
    real = printed.tcr_values()["kaist", "01", "06"]
    # The paper's Table I: each map's first stage against its last.
    widest: dict[str, ChangeResult] = {}
    for result in changes:
        best = widest.get(result.map_name)
        if best is None or result.stages[0] < best.stages[0]:
            widest[result.map_name] = result
    reached = [
        name
        for name, result in widest.items()
        if result.report.change.symmetric >= real
    ]
    values = ", ".join(
        f"{name} {result.report.change.symmetric:.4f}"
        for name, result in widest.items()
    )
    return Finding(
        f"The change meets or surpasses that of four years at KAIST"
        f" ({real:.4f}).",
        _part(len(reached), len(widest)),
        f"First stage against last, TCR_sym: {values}. In the paper's own"
        " numbers only Suburbia (0.1840) and Metropolis (0.2920) do.",
    )


def _ring_is_best(results: Sequence[RecognitionResult]) -> Finding:
    pairs = list(dict.fromkeys(result.pair for result in results))
    measures: dict[str, Callable] = {
        "AUC": lambda metrics: metrics.auc,
        "R@1": lambda metrics: metrics.recall_at_1,
    }
    counts, others = [], {}
    wins = {}
    for name, measure in measures.items():
        for mode in MODES:
            best = [
                max(
                    (r for r in results if r.pair == pair),
                    key=lambda r: measure(r.metrics[mode]),
                ).method
                for pair in pairs
            ]
            if name == "R@1" and mode != MODES[0]:
                continue  # R@1 is the same in both modes.
            wins[name, mode] = best.count("ring++")
            label = name if name == "R@1" else f"{name} (mode {mode})"
            counts.append(f"{wins[name, mode]} of {len(pairs)} by {label}")
            if (name, mode) == ("AUC", MODES[0]):
                others = {
                    method: best.count(method)
                    for method in best
                    if method != "ring++"
                }
    evidence = f"RING++ is best on {', '.join(counts)}."
    if others:
        listed = ", ".join(
            f"{title(method)} {count}" for method, count in others.items()
        )
        evidence += f" Elsewhere by AUC (mode all): {listed}."
    return Finding(
        "RING++ is best on every pair.",
        _part(min(wins.values()), len(pairs)) if max(wins.values()) else FAILS,
        evidence,
    )


def _falls(
    results: Sequence[RecognitionResult],
    tcr: Mapping[tuple[str, str, str], float],
    methods: Sequence[str],
) -> Finding:
    claim = (
        "Place recognition gets worse as TCR_sym grows (for BTC the paper"
        " says it does not)."
    )
    trends = _trends(results, tcr, methods)
    # One wording for all; the paper itself makes an exception of BTC.
    judged = {m: t for m, t in trends.items() if m != "btc"}
    if not judged:
        return Finding(claim, UNDECIDED, _too_few(results))
    falling = sum(t.falls for t in judged.values())
    return Finding(claim, _part(falling, len(judged)), _describe_trends(trends))


def _btc_is_flat(
    results: Sequence[RecognitionResult],
    tcr: Mapping[tuple[str, str, str], float],
    methods: Sequence[str],
) -> Finding:
    claim = "BTC hardly depends on TCR_sym."
    trends = _trends(results, tcr, methods)
    if "btc" not in trends:
        return Finding(claim, UNDECIDED, _too_few(results))
    btc = trends["btc"]
    flattest = min(trends, key=lambda m: abs(trends[m].slope))
    if btc.falls:
        verdict = FAILS
    else:
        verdict = HOLDS if flattest == "btc" else IN_PART
    spreads = ", ".join(f"{title(m)} {t.spread:.3f}" for m, t in trends.items())
    return Finding(
        claim,
        verdict,
        f"Slope {btc.slope:+.3f} AUC for 0.1 of TCR_sym (rank correlation"
        f" {btc.rho:+.2f}, p = {btc.p_value:.2f}); the flattest is"
        f" {title(flattest)}. Greatest less least AUC: {spreads}.",
    )


def _trends(
    results: Sequence[RecognitionResult],
    tcr: Mapping[tuple[str, str, str], float],
    methods: Sequence[str],
) -> dict[str, Trend]:
    """Returns method -> its trend in mode all, where pairs suffice."""
    trends = {}
    for method in methods:
        points = [
            (tcr[r.pair], r.metrics["all"].auc)
            for r in results
            if r.method == method
        ]
        if len(points) >= _FEWEST_PAIRS:
            trends[method] = trend(*zip(*points, strict=True))
    return trends


def _describe_trends(trends: dict[str, Trend]) -> str:
    known = {key[3] for key in printed.recognition_values()}
    parts = []
    for method, ours in trends.items():
        text = (
            f"{title(method)} {ours.rho:+.2f} (p = {ours.p_value:.2f},"
            f" {ours.slope:+.3f} AUC for 0.1)"
        )
        if method in known:
            theirs = paper_trend(method)
            text += (
                f", in the paper's table {theirs.rho:+.2f}"
                f" (p = {theirs.p_value:.2f}, {theirs.slope:+.3f})"
            )
        parts.append(text)
    return (
        "Rank correlation of AUC (mode all) with TCR_sym over"
        f" {next(iter(trends.values())).num_pairs} pairs: "
        + "; ".join(parts)
        + "."
    )


def _too_few(results: Sequence[RecognitionResult]) -> str:
    number = len({result.pair for result in results})
    return (
        f"{number} pair{'s' if number > 1 else ''} of drives;"
        f" a trend needs {_FEWEST_PAIRS} or more."
    )


def _part(number: int, total: int) -> str:
    if number == total:
        return HOLDS
    return IN_PART if number else FAILS
