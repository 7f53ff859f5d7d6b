"""Verdicts: the paper's findings, and the targets of the shipped cities.

TCR_sym and SOLiD's AUC were fitted to the paper. The results of other methods
were not fitted, but had been seen before later versions of the cities were
frozen.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
import itertools

import numpy as np

from evaluation.paper.paper_values import KAIST, Measured, StagePair, paper
from evaluation.recognition import Mode
from evaluation.results import LEAST_POINTS, in_table_order, listed, title

# Verdicts on a target.
MET = "is met"
MISSED = "is missed"
# Greatest difference of TCR_sym from the paper, on every pair.
_TCR_TOLERANCE = 0.015
# Aim: method, greatest difference of AUC, and share of pairs that meet it.
_AUC_AIMS = (
    ("ring++", 0.12, 0.8),
    ("scan-context++", 0.20, 0.7),
    ("solid", 0.20, 0.7),
)
# Least share of pairs on which RING++ is the best method.
_BEST_SHARE = 0.9
_RING = title("ring++")
# Greatest mean difference of all AUCs from the paper.
_MEAN_DIFFERENCE = 0.15
# A rank correlation of at least this magnitude is a trend. There is no p-value:
# the pairs of one city share its streets, and there are four cities.
_TREND = 0.5
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
        slope: change of AUC per 0.1 of TCR_sym, by the least-squares line.
        spread: greatest minus least AUC.
        num_pairs: number of pairs of drives.
    """

    rho: float
    slope: float
    spread: float
    num_pairs: int

    @property
    def falls(self) -> bool:
        """Whether the correlation is clearly negative."""
        return self.rho <= -_TREND


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
        return Trend(np.nan, 0.0, spread, len(x))
    # Slow to import, and not needed by the processes of jobs.
    from scipy.stats import linregress, spearmanr

    return Trend(
        rho=float(spearmanr(x, y).statistic),
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
    best = _best_methods(results)
    evidence = (
        "In the table beside the paper's numbers (protocol paper), the paper's"
        f" method with the greatest AUC on {len(best)} pairs is"
        f" {_listed_counts(best)}. {_best_with_all_queries(results)}"
    )
    asked = shown[0].protocol
    if asked != "paper":
        words = f"With the protocol {asked}, as in the other tables"
        evidence += f" {_best_with_all_queries(shown, words)}"
    return Finding(
        "RING++ is the best of the paper's methods on every pair, as the paper"
        " counts.",
        _share_verdict(sum(_RING in methods for methods in best), len(best)),
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
            f"{title(method)} {ours.rho:+.2f} ({ours.slope:+.3f} AUC for 0.1),"
            f" in the paper's table {theirs.rho:+.2f} ({theirs.slope:+.3f})"
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
        f" {btc.rho:+.2f}); the flattest is"
        f" {title(flattest)}. Greatest less least AUC: {spreads}.",
        _BOTH,
    )


def _share_verdict(number: int, total: int) -> str:
    if number == total:
        return HOLDS
    return IN_PART if number else FAILS


def aims(
    results: Sequence[Measured], changes: Mapping[StagePair, float]
) -> list[Finding]:
    """Returns, for each target of the shipped cities, whether it is met.

    The targets compare results in the shipped cities with the paper's results.
    The list is empty unless `results` contains all of the paper's pairs of
    drives.

    As the paper seems to do, RING++ is scored on the queries with a match, and
    all other methods on all queries.
    """
    known = [one for one in results if paper().is_comparable(one)]
    differences = _auc_differences(known)
    if differences.keys() != paper().recognitions.keys():
        return []
    pairs = list(dict.fromkeys(key[:3] for key in differences))
    tcr = [
        abs(value - paper().changes[pair])
        for pair, value in changes.items()
        if pair in paper().changes
    ]
    best = _best_methods(known)
    found = [
        _aim_by_pairs(
            f"TCR_sym within {_TCR_TOLERANCE:g} of the paper's",
            [value <= _TCR_TOLERANCE for value in tcr],
            1.0,
            table="Table I",
        ),
        _aim_by_pairs(
            "RING++ is the best of the paper's methods by AUC, as the paper"
            " counts",
            [_RING in methods for methods in best],
            _BEST_SHARE,
            f" The best: {_listed_counts(best)}."
            f" {_best_with_all_queries(known)}",
        ),
    ]
    of_methods = {
        method: np.array([differences[(*pair, method)] for pair in pairs])
        for method in dict.fromkeys(name for *_, name in differences)
    }
    for method, tolerance, share in _AUC_AIMS:
        off = of_methods[method]
        found.append(
            _aim_by_pairs(
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


def _auc_differences(
    results: Sequence[Measured],
) -> dict[tuple[str, str, str, str], float]:
    """Returns our AUC minus the AUC in the paper.

    The keys of the result are (map, database, query, method).
    """
    found = {}
    for result in results:
        theirs = paper().printed(result)
        if theirs is not None:
            key = (*result.pair, result.method)
            found[key] = paper().counted(result).auc - theirs.auc
    return found


def _aim_by_pairs(
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


def _best_with_all_queries(
    results: Sequence[Measured],
    words: str = "If all queries count for every method",
) -> str:
    """Returns a sentence on which methods are best if all queries count.

    That is the mode `all` for every method.
    """
    best = _best_methods(results, "all")
    number = sum(_RING in methods for methods in best)
    return (
        f"{words}, {_RING} is best on {number} of {len(best)} pairs"
        f" ({_listed_counts(best)})."
    )


def _best_methods(
    results: Sequence[Measured], mode: Mode | None = None
) -> list[list[str]]:
    """Returns the methods with the greatest AUC on each pair.

    Table II of the paper prints these methods in bold. A pair has several best
    methods if their AUCs are equal as printed, with four decimals. A method
    that is alone on a pair is not the best. By default, each method is scored
    in the mode that the paper used for it.
    """
    of_pair: dict[StagePair, dict[str, float]] = {}
    for one in results:
        numbers = paper().counted(one) if mode is None else one.by_mode[mode]
        shown = of_pair.setdefault(one.pair, {})
        shown[one.method] = round(numbers.auc, 4)
    return [
        [
            title(name)
            for name in in_table_order(shown)
            if len(shown) > 1 and shown[name] == max(shown.values())
        ]
        for shown in of_pair.values()
    ]


def _listed_counts(best: Iterable[Iterable[str]]) -> str:
    """Returns on how many pairs each method is best, as text.

    The text has the form "<method> on <number>, ...".
    """
    counts = Counter(itertools.chain.from_iterable(best)).most_common()
    return ", ".join(f"{method} on {number}" for method, number in counts)
