"""Reference values of a report: the paper's numbers and claims, and aims.

The aims are the targets to which this project fitted its cities: TCR_sym and
SOLiD's AUC were fitted to the paper. The results of other methods were not
fitted, but had been seen before later versions of the cities were frozen.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
import csv
from dataclasses import dataclass, replace
import functools
from importlib import resources
import itertools

import numpy as np

from evaluation.change.drive_change import ChangeResult, symmetric_changes
from evaluation.recognition.metrics import Mode
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.recognition.protocol import PAPER_PROTOCOL
from evaluation.report.reference import (
    NO_REFERENCE,
    Finding,
    Judgement,
    Published,
    Reference,
)
from evaluation.report.result_tables import recognition_table
from evaluation.results.summaries import LEAST_POINTS
from evaluation.results.table_forms import Cell, in_table_order, title

_TITLE = "the paper “The City that Never Settles”"
# Drives through a real city in the paper's tables.
_KAIST = ("kaist", "01", "06")
_SIGNIFICANCE = 0.05
_RING = title("ring++")

HOLDS = "holds"
IN_PART = "holds in part"
FAILS = "does not hold"
UNDECIDED = "cannot be judged"
FITTED = "was fitted"
MET = "is met"
MISSED = "is missed"
_BOTH = "Tables I and II"

_TCR_TOLERANCE = 0.015
# Aim: method, greatest difference of AUC, and share of pairs that meet it.
_AUC_AIMS = (
    ("ring++", 0.12, 0.8),
    ("scan-context++", 0.20, 0.7),
    ("solid", 0.20, 0.7),
)
_BEST_SHARE = 0.9
_MEAN_DIFFERENCE = 0.15


def reference_for(map_names: Iterable[str]) -> Reference:
    """Returns the values of the CNS paper for a report on some maps.

    If none of the maps occurs in the paper, the result has no values.
    """
    return NO_REFERENCE if paper().city_names.isdisjoint(map_names) else paper()


@functools.cache
def paper() -> Reference:
    """Returns the values and claims that the paper prints.

    Two misprints are corrected, each with a note in its row: Table I gives
    Downtown 01-04 the value of 02-04, and one R@1 of RING++ on Riverside 02->01
    contradicts the F1 beside it. The paper does not state whether a method was
    scored on all queries or only on queries with a match (the mode, see
    `evaluation.recognition.metrics`). The mode is inferred from the relation
    between R@1, F1 and AUC in all rows of the method.
    """
    changes = {
        (row["map"], row["sequence_a"], row["sequence_b"]): float(
            row["tcr_sym"]
        )
        for row in _rows("tcr.csv")
    }
    recognitions: dict[tuple[str, str, str, str, Mode], Published] = {
        (
            row["map"],
            row["database"],
            row["query"],
            row["method"],
            "filtered" if row["mode"] == "filtered" else "all",
        ): Published(
            float(row["auc"]), float(row["recall_at_1"]), float(row["f1_max"])
        )
        for row in _rows("place_recognition.csv")
    }
    return Reference(
        title=_TITLE,
        counting="counted as the paper seems to have done: RING++ on the"
        " queries that have a match (mode filtered), the others on all (mode"
        " all)",
        changes=changes,
        # Real drives, four years apart.
        further=[("kaist (real)", "01 ↔ 06", changes[_KAIST])],
        recognitions=recognitions,
        protocols={
            key[3]: replace(
                PAPER_PROTOCOL, scans_per_place=10 if key[3] == "btc" else 1
            )
            for key in recognitions
        },
        judge=_judge,
    )


def _rows(name: str) -> list[dict[str, str]]:
    text = resources.files(__package__).joinpath(name).read_text("utf-8")
    return list(csv.DictReader(text.splitlines()))


def _judge(
    results: Sequence[PlaceOutcome], changes: Sequence[ChangeResult]
) -> list[Judgement]:
    found = (
        (f"What {_TITLE} claims", findings(results, changes)),
        (
            "How near to the paper's numbers, to which TCR_sym and the AUC of"
            " SOLiD were fitted",
            aims(results, changes),
        ),
    )
    return [Judgement(name, judged) for name, judged in found if judged]


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
        return self.rho < 0.0 and self.p_value < _SIGNIFICANCE


def findings(
    results: Sequence[PlaceOutcome], changes: Sequence[ChangeResult]
) -> list[Finding]:
    """Returns a verdict on each of the paper's findings that can be tested.

    A finding can be tested if `results` and `changes` contain the data on this
    finding. Only results on the paper's maps, with the paper's methods and
    protocol, count. If a method has several results on a pair, the first result
    counts, as in the report's tables.
    """
    shown = {
        (*r.pair, r.method): r
        for r in reversed(results)
        if r.pair[0] in paper().city_names and r.method in paper().protocols
    }
    results = [r for r in results if paper().covers(r)]
    changes = [c for c in changes if c.map_name in paper().city_names]
    tcr = symmetric_changes(changes)
    methods = in_table_order(result.method for result in results)
    found = []
    if changes:
        found.append(_larger_than_real(changes))
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

    The AUC values are those of the paper's Table II.
    """
    return trend(*zip(*paper().auc_over_change(method), strict=True))


def _trends(
    results: Sequence[PlaceOutcome],
    tcr: Mapping[tuple[str, str, str], float],
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


def _larger_than_real(changes: Sequence[ChangeResult]) -> Finding:
    real = paper().changes[_KAIST]
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
        FITTED,
        f"TCR_sym between the first and the last stage: {values}. Cities"
        f" in which it reaches KAIST's: {len(reached)} of {len(widest)}. They"
        " were fitted to the paper's values, which reach KAIST's only in"
        " Suburbia (0.1840) and Metropolis (0.2920).",
        "Table I",
    )


def _ring_is_best(
    results: Sequence[PlaceOutcome], shown: Sequence[PlaceOutcome]
) -> Finding:
    best = _best_methods(results)
    evidence = (
        "In the table beside the paper's numbers (protocol paper), the paper's"
        f" method with the greatest AUC on {len(best)} pairs is"
        f" {_listed(best)}. {_counted_alike(results)}"
    )
    asked = shown[0].protocol_name
    if asked != "paper":
        words = f"With the protocol {asked}, as in the other tables"
        evidence += f" {_counted_alike(shown, words)}"
    return Finding(
        "RING++ is the best of the paper's methods on every pair, as the paper"
        " counts.",
        _part(sum(_RING in methods for methods in best), len(best)),
        evidence,
        "Table II",
    )


def _counted_alike(
    results: Sequence[PlaceOutcome],
    words: str = "If all queries count for every method",
) -> str:
    """Returns a sentence on which methods are best if all queries count.

    That is the mode `all` for every method.
    """
    best = _best_methods(results, "all")
    number = sum(_RING in methods for methods in best)
    return (
        f"{words}, {_RING} is best on {number} of {len(best)} pairs"
        f" ({_listed(best)})."
    )


def _best_methods(
    results: Sequence[PlaceOutcome], mode: Mode | None = None
) -> list[list[str]]:
    """Returns the methods with the greatest AUC on each pair.

    Table II of the paper prints these methods in bold. A pair has several if
    their AUCs are equal as printed. By default, each method is scored in the
    mode that the paper used for it.
    """
    table = recognition_table(results, (), mode, paper())
    methods = [name for name, _ in table.groups[1:]]
    step = table.groups[1][1]  # AUC is the first of a method's columns.
    return [
        [
            method
            for method, cell in zip(
                methods, row[-step * len(methods) :: step], strict=True
            )
            if isinstance(cell, Cell) and cell.rank == 1
        ]
        for row in table.rows
    ]


def _listed(best: Iterable[Iterable[str]]) -> str:
    """Returns on how many pairs each method is best, as text.

    The text has the form "<method> on <number>, ...".
    """
    counts = Counter(itertools.chain.from_iterable(best)).most_common()
    return ", ".join(f"{method} on {number}" for method, number in counts)


def _falls(trends: Mapping[str, Trend], too_few: str) -> Finding:
    claim = (
        "Place recognition gets worse as TCR_sym grows (for BTC the paper"
        " says it does not)."
    )
    # The wording is the same for all methods; the paper itself makes an
    # exception for BTC.
    falls = [one.falls for name, one in trends.items() if name != "btc"]
    if not falls:
        return Finding(claim, UNDECIDED, too_few)
    known = {key[3] for key in paper().recognitions}
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
    evidence = (
        "Rank correlation of AUC (mode all) with TCR_sym over"
        f" {next(iter(trends.values())).num_pairs} pairs: {'; '.join(parts)}."
    )
    return Finding(claim, _part(sum(falls), len(falls)), evidence, _BOTH)


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


def _part(number: int, total: int) -> str:
    if number == total:
        return HOLDS
    return IN_PART if number else FAILS


def aims(
    results: Sequence[PlaceOutcome], changes: Sequence[ChangeResult]
) -> list[Finding]:
    """Returns, for each target of the shipped cities, whether it is met.

    The targets compare results in the shipped cities with those of the paper.
    The list is empty unless `results` contains all of the paper's pairs of
    drives.

    As the paper seems to do, RING++ is scored on the queries with a match, and
    all other methods on all queries.
    """
    differences = _differences(results)
    if differences.keys() != {
        (*key[:3], key[3]) for key in paper().recognitions
    }:
        return []
    pairs = list(dict.fromkeys(key[:3] for key in differences))
    tcr = [
        abs(value - paper().changes[pair])
        for pair, value in symmetric_changes(changes).items()
        if pair in paper().changes
    ]
    known = [r for r in results if paper().covers(r)]
    best = _best_methods(known)
    found = [
        _counted(
            f"TCR_sym within {_TCR_TOLERANCE:g} of the paper's",
            [value <= _TCR_TOLERANCE for value in tcr],
            1.0,
            table="Table I",
        ),
        _counted(
            "RING++ is the best of the paper's methods by AUC, as the paper"
            " counts",
            [_RING in methods for methods in best],
            _BEST_SHARE,
            f" The best: {_listed(best)}. {_counted_alike(known)}",
        ),
    ]
    of_methods = {
        method: np.array([differences[(*pair, method)] for pair in pairs])
        for method in dict.fromkeys(key[3] for key in differences)
    }
    for method, tolerance, share in _AUC_AIMS:
        off = of_methods[method]
        found.append(
            _counted(
                f"{title(method)}: AUC within {tolerance:g} of the paper's",
                [abs(value) <= tolerance for value in off],
                share,
                f" The mean of AUC less the paper's is {off.mean():+.3f}.",
            )
        )
    means = {method: abs(off).mean() for method, off in of_methods.items()}
    mean = float(np.abs(list(differences.values())).mean())
    farthest = max(means, key=lambda method: means[method])
    last = Finding(
        f"Mean difference of all {len(differences)} AUCs at most"
        f" {_MEAN_DIFFERENCE:g}.",
        MET if mean <= _MEAN_DIFFERENCE else MISSED,
        f"It is {mean:.3f}. The greatest is that of {title(farthest)},"
        f" {means[farthest]:.3f}.",
        "Table II",
    )
    return [*found, last]


def _differences(
    results: Sequence[PlaceOutcome],
) -> dict[tuple[str, str, str, str], float]:
    """Returns (map, database, query, method) -> our AUC minus the paper's."""
    found = {}
    for result in results:
        mode = paper().mode(result.method)
        theirs = paper().values(result, mode)
        if theirs is not None:
            key = (*result.pair, result.method)
            found[key] = result.by_mode[mode].auc - theirs.auc
    return found


def _counted(
    claim: str,
    reached: Sequence[bool],
    share: float,
    more: str = "",
    table: str = "Table II",
) -> Finding:
    wanted = round(share * len(reached))
    return Finding(
        f"{claim}, on {wanted} of {len(reached)} pairs.",
        MET if sum(reached) >= wanted else MISSED,
        f"It is so on {sum(reached)}.{more}",
        table,
    )
