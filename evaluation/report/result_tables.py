"""What a report holds, and the tables made of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from evaluation.change.change_result import ChangeResult, symmetric_changes
from evaluation.recognition.metrics import (
    MODES,
    Mode,
)
from evaluation.recognition.protocol import (
    PROTOCOL_COLUMNS,
    protocol_values,
)
from evaluation.recognition.recognition_result import RecognitionResult
from evaluation.report import paper
from evaluation.report.tables import Table, ranked

# The order of the paper, and how it writes the names; ours after them.
_TITLES = {
    "scan-context++": "Scan Context++",
    "solid": "SOLiD",
    "ring++": "RING++",
    "btc": "BTC",
    "layered-overlap": "Layered overlap",
}


def title(method: str) -> str:
    """Returns a method's name as the paper writes it."""
    return _TITLES.get(method, method)


def in_paper_order(methods: Iterable[str]) -> list[str]:
    """Returns methods in the paper's order, others after them by name."""
    known = list(_TITLES)
    return sorted(
        set(methods),
        key=lambda m: (known.index(m) if m in known else len(known), m),
    )


def protocol_text(results: Sequence[RecognitionResult]) -> str:
    """Returns what was asked; how many scans a place is, is each method's."""
    if not results:
        return ""
    return replace(results[0].outcome.protocol, scans_per_place=None).to_text()


def is_of_paper(result: RecognitionResult) -> bool:
    """Tells whether the paper has such a number: map, method and protocol."""
    return (
        result.pair[0] in paper.city_names()
        and result.method in paper.method_names()
        and paper.is_protocol(result.method, result.outcome.protocol)
    )


def shows_paper(results: Iterable[RecognitionResult]) -> bool:
    """Tells whether one of the results has the paper's beside it."""
    return any(map(is_of_paper, results))


def by_pair_and_method(
    results: Sequence[RecognitionResult],
) -> list[RecognitionResult]:
    """Returns results pair by pair, methods in the paper's order."""
    pairs = list(dict.fromkeys(result.pair for result in results))
    methods = in_paper_order(result.method for result in results)
    return sorted(
        results,
        key=lambda r: (pairs.index(r.pair), methods.index(r.method)),
    )


def paper_mode(method: str) -> Mode:
    """Returns the mode that the paper seems to have counted a method in."""
    for key in paper.recognition_values():
        if key[3] == method:
            return key[4]
    return "all"


def paper_values(
    result: RecognitionResult, mode: Mode
) -> paper.PaperRecognition | None:
    """Returns the paper's values, if it counted in this mode.

    None for numbers that were found by another protocol than the paper's.
    """
    if not paper.is_protocol(result.method, result.outcome.protocol):
        return None
    return paper.recognition_values().get((*result.pair, result.method, mode))


def change_table(results: Sequence[ChangeResult]) -> Table:
    """Returns Table I: the change of each pair, and what it is made of.

    The paper's value for real drives through KAIST stands below its maps, to
    compare with.
    """
    header = (
        "map",
        "stages",
        "TCR_sym",
        "paper",
        "earlier → later",
        "later → earlier",
        "same stage, both routes",
        "where both drove",
        "voxels in hulls",
        "unchanged",
    )
    rows: list[tuple] = []
    for result in results:
        report = result.report
        change = report.change
        rows.append(
            (
                result.map_name,
                " ↔ ".join(result.stages),
                change.symmetric,
                paper.tcr_values().get((result.map_name, *result.stages)),
                change.source_to_target.ratio,
                change.target_to_source.ratio,
                report.control.symmetric if report.control else None,
                report.masked.symmetric if report.masked else None,
                change.num_in_hull,
                change.num_unchanged,
            )
        )
    if any(result.map_name in paper.city_names() for result in results):
        kaist = paper.tcr_values()["kaist", "01", "06"]
        rows.append(("kaist (real)", "01 ↔ 06", None, kaist) + (None,) * 6)
    return Table(
        header,
        tuple(rows),
        caption="Temporal change ratio. Same stage: TCR_sym of the two routes"
        " in one stage of the city, where nothing changed. Where both drove:"
        " only voxels within 40 m of both routes.",
    )


def recognition_tables(
    results: Sequence[RecognitionResult], changes: Sequence[ChangeResult]
) -> list[Table]:
    """Returns Table II in its forms.

    First as the paper seems to have counted, where its maps are shown; then
    in each mode.
    """
    modes: list[Mode | None] = list(MODES)
    if shows_paper(results):
        modes.insert(0, None)
    return [recognition_table(results, changes, mode) for mode in modes]


def recognition_table(
    results: Sequence[RecognitionResult],
    changes: Sequence[ChangeResult],
    mode: Mode | None = None,
) -> Table:
    """Returns Table II: a row for each pair, three columns for each method.

    Args:
        results: of all pairs and methods.
        changes: for the TCR_sym of the pairs.
        mode: in which methods are counted; None for that which the paper
            seems to have used for each.
    """
    if mode is None:
        results = [r for r in results if r.method in paper.method_names()]
    methods = in_paper_order(result.method for result in results)
    names = ("AUC", "R@1", "F1")
    tcr = symmetric_changes(changes)
    by_pair: dict[tuple, dict[str, RecognitionResult]] = {}
    for result in results:
        by_pair.setdefault(result.pair, {})[result.method] = result
    rows = []
    for pair, of_method in by_pair.items():
        map_name, *stages = pair
        columns = []
        for name in names:
            values, printed = [], []
            for method in methods:
                ours, theirs = _numbers(of_method.get(method), mode, name)
                values.append(ours)
                printed.append(theirs)
            columns.append(ranked(values, printed))
        cells = [column[i] for i in range(len(methods)) for column in columns]
        rows.append((map_name, " → ".join(stages), tcr.get(pair), *cells))
    captions = {
        None: "Place recognition, counted as the paper seems to have done:"
        " RING++ on the queries that have a match (mode filtered), the"
        " others on all (mode all)",
        "all": "Place recognition, all queries counted (mode all)",
        "filtered": "Place recognition, only queries counted that have a"
        " match (mode filtered; F1 then says no more than R@1)",
    }
    return Table(
        ("map", "DB → query", "TCR_sym", *names * len(methods)),
        tuple(rows),
        groups=(("", 3), *((title(method), 3) for method in methods)),
        caption=f"{captions[mode]}. {protocol_text(results)} In brackets or"
        " small: the paper's value. Bold: best of a row; underlined: second.",
    )


def audit_table(results: Sequence[RecognitionResult]) -> Table:
    """Returns all numbers with what they are made of, one row for each."""
    header = (
        "map",
        "DB → query",
        "method",
        "mode",
        "AUC",
        "AUC low",
        "AUC high",
        "paper's AUC",
        "R@1",
        "R@1 low",
        "R@1 high",
        "paper's R@1",
        "R@5",
        "R@25",
        "R@1%",
        "F1max",
        "paper's F1",
        "queries",
        "N (with a match)",
        "TP of R@1",
        "TP of F1max",
        "T of F1max",
        *PROTOCOL_COLUMNS,
    )
    rows = []
    for result in results:
        for mode in MODES:
            metrics = result.metrics[mode]
            printed = paper_values(result, mode)
            index = metrics.f1_max_index
            curve = metrics.curve
            rows.append(
                (
                    result.map_name,
                    " → ".join(result.stages),
                    result.method,
                    mode,
                    metrics.auc,
                    metrics.auc_interval.low,
                    metrics.auc_interval.high,
                    printed.auc if printed else None,
                    metrics.recall_at_1,
                    metrics.recall_at_1_interval.low,
                    metrics.recall_at_1_interval.high,
                    printed.recall_at_1 if printed else None,
                    float(metrics.recall_at_n[4]),
                    float(metrics.recall_at_n[24]),
                    float(metrics.recall_at_1_percent),
                    metrics.f1_max,
                    printed.f1_max if printed else None,
                    metrics.num_queries,
                    metrics.num_with_match,
                    metrics.num_right,
                    None if index is None else int(curve.true_positives[index]),
                    None if index is None else int(curve.counted[index]),
                    *protocol_values(result.outcome.protocol),
                )
            )
    return Table(
        header,
        tuple(rows),
        caption="All numbers with 95 % intervals (bootstrap over queries) and"
        " the counts they are made of: R@1 = TP / N, F1max = 2 TP / (TP + T).",
    )


def _numbers(
    result: RecognitionResult | None, mode: Mode | None, name: str
) -> tuple[float | None, float | None]:
    """Returns our value and the paper's."""
    if result is None:
        return None, None
    mode = paper_mode(result.method) if mode is None else mode
    metrics, printed = result.metrics[mode], paper_values(result, mode)
    ours = {
        "AUC": metrics.auc,
        "R@1": metrics.recall_at_1,
        "F1": metrics.f1_max,
    }[name]
    if printed is None:
        return ours, None
    return ours, {
        "AUC": printed.auc,
        "R@1": printed.recall_at_1,
        "F1": printed.f1_max,
    }[name]
