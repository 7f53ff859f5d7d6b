"""The tables of a report: change, recognition, faults, poses, costs, queries.

Functions named `..._table` return tables for print; functions named
`..._numbers` return tables with all digits, for files.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from operator import attrgetter
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evaluation.change.drive_change import ChangeResult, symmetric_changes
from evaluation.recognition.costs import Cost
from evaluation.recognition.fault_kinds import (
    ELSEWHERE_KINDS,
    FAULT_KINDS,
    PairEvidence,
    fault_kinds,
    fault_words,
)
from evaluation.recognition.faults import ELSEWHERE
from evaluation.recognition.metrics import MODES, Mode, PlaceRecognitionMetrics
from evaluation.recognition.place_numbers import kept_share
from evaluation.recognition.place_outcome import RADII, PlaceOutcome
from evaluation.recognition.protocol import PROTOCOL_COLUMNS, check_one_protocol
from evaluation.recognition.significance import Difference, compared_by_auc
from evaluation.report.reference import NO_REFERENCE, Published, Reference
from evaluation.results.table_forms import (
    CAPTIONS,
    Cell,
    Columns,
    Table,
    by_pair,
    by_pair_and_method,
    in_table_order,
    keyed,
    protocol_columns,
    ranked,
    title,
)

# Name in Table II -> attribute of our metrics and of published numbers, which
# may lack it.
_MEASURES = {"AUC": "auc", "strict": "auc_strict", "R@1": "recall_at_1"}
# The reference has this, too.
_PUBLISHED = {**_MEASURES, "F1": "f1_max"}
# Frame, time and pose of a sensor, as columns of files.
_MOMENT = ("frame", "stamp_ns", "x", "y", "z", "qx", "qy", "qz", "qw")

# Evidence for pairs of drives: (database, query) -> evidence.
Evidence = Mapping[tuple[str, str], PairEvidence]


def _inner(columns: Columns[PlaceOutcome]) -> Columns[Any]:
    """Returns columns of results, applied to the field `result` of items."""
    return keyed(columns, lambda item, value: value(item.result))


# The first columns, for print and in files, and the last ones in files.
_SHOWN: Columns[PlaceOutcome] = {
    "map": lambda r: r.pair[0],
    "DB → query": lambda r: " → ".join(r.pair[1:]),
    "method": lambda r: title(r.method),
}
_KEYS: Columns[PlaceOutcome] = {
    "map": lambda r: r.pair[0],
    "db": lambda r: r.pair[1],
    "query": lambda r: r.pair[2],
    "method": lambda r: r.method,
}
_PROTOCOL = protocol_columns("")


def change_table(
    results: Sequence[ChangeResult],
    reference: Reference = NO_REFERENCE,
    evidence: Evidence = MappingProxyType({}),
) -> Table:
    """Returns Table I of a report: the change between the drives of each pair.

    Args:
        results: change of each pair.
        reference: published results to put next to them.
        evidence: (database, query) -> evidence from scans, for the column with
            the visible change.
    """

    def visible(one: ChangeResult) -> tuple[float | None, ...]:
        return _visible_change(evidence, one.report.source, one.report.target)

    table = Table.of(
        results,
        {
            "map": lambda r: r.map_name,
            "stages": lambda r: " ↔ ".join(r.stages),
            "TCR_sym": lambda r: r.report.change.symmetric,
            "paper": lambda r: reference.change(r.map_name, r.stages),
            "earlier → later": lambda r: r.report.change.source_to_target.ratio,
            "later → earlier": lambda r: r.report.change.target_to_source.ratio,
            "same stage, both routes": lambda r: (
                r.report.control.symmetric if r.report.control else None
            ),
            "where both drove": lambda r: (
                r.report.masked.symmetric if r.report.masked else None
            ),
            "voxels in hulls": lambda r: r.report.change.num_in_hull,
            "unchanged": lambda r: r.report.change.num_unchanged,
            "visible change": lambda r: visible(r)[0],
            "minus the control's": lambda r: visible(r)[2],
            "share left": lambda r: visible(r)[3],
            "queries": lambda r: visible(r)[1],
            "least of the grids": lambda r: r.report.spread[0],
            "greatest": lambda r: r.report.spread[1],
        },
        CAPTIONS["change"],
    )
    names = {result.map_name for result in results}
    further = tuple(
        (label, stages, None, value, *(None,) * (len(table.header) - 4))
        for label, stages, value in reference.further_changes(names)
    )
    return replace(table, rows=table.rows + further)


def _visible_change(
    evidence: Evidence, database: str, query: str
) -> tuple[float | None, ...]:
    """Returns four values on a pair's visible change; None if unknown.

    The values are: the mean visible change (share of a query's scan that its
    right place does not show); the number of queries; the mean minus that of
    the control; and this difference as a share of the mean.
    """
    known = evidence.get((database, query))
    if known is None:
        return (None,) * 4
    whole, queries = known.mean_visible_change
    added = known.visible_change_added
    return whole, queries, added, float(kept_share(added, whole))


class _Counted(NamedTuple):
    """A result in one mode, with the published numbers if there are any."""

    result: PlaceOutcome
    metrics: PlaceRecognitionMetrics
    printed: Published | None

    @classmethod
    def of(
        cls, result: PlaceOutcome, mode: Mode, reference: Reference
    ) -> _Counted:
        printed = reference.values(result, mode)
        return cls(result, result.by_mode[mode], printed)

    def at_f1_max(self, counts: np.ndarray) -> int | None:
        """Returns the entry of `counts` for the threshold with the greatest F1.

        `counts` (K,) contains a number of queries, such as TP, for each
        threshold of the precision-recall curve. The result is None if the curve
        is empty.
        """
        index = self.metrics.f1_max_index
        return None if index is None else int(counts[index])


def recognition_table(
    results: Sequence[PlaceOutcome],
    changes: Sequence[ChangeResult],
    mode: Mode | None = None,
    reference: Reference = NO_REFERENCE,
    evidence: Evidence = MappingProxyType({}),
) -> Table:
    """Returns the table of place recognition, like Table II of the paper.

    The table has a row for each pair of drives, and the columns AUC, strict AUC
    and R@1 for each method. If `mode` is None, each method also has a column
    F1.

    Args:
        results: results of one protocol.
        changes: change between the drives of each pair.
        mode: which queries count: `all`, or only queries with a match
            (`filtered`). None for the mode that the reference has for each
            method.
        reference: published results to compare with.
        evidence: names of a database and a query -> why queries went wrong.

    Raises:
        InputError: results of two protocols.
    """
    check_one_protocol(result.protocol for result in results)
    methods = in_table_order(result.method for result in results)
    measures = _PUBLISHED if mode is None else _MEASURES
    tcr = symmetric_changes(changes)
    rows = []
    for pair, some in by_pair(results).items():
        of_method = {
            one.method: _Counted.of(
                one, mode or reference.mode(one.method), reference
            )
            for one in some
        }
        found = [of_method.get(method) for method in methods]
        columns = [
            ranked(
                [one and getattr(one.metrics, name) for one in found],
                [one and getattr(one.printed, name, None) for one in found],
            )
            for name in measures.values()
        ]
        cells = [column[i] for i in range(len(methods)) for column in columns]
        drives = some[0].database, some[0].query
        whole, _, added, _ = _visible_change(evidence, *drives)
        shown = tcr.get(pair), Cell(whole, added)
        rows.append((pair[0], " → ".join(pair[1:]), *shown, *cells))
    captions = {
        None: f", {reference.counting}",
        "all": ", all queries counted (mode all)",
        "filtered": ", only queries counted that have a match (mode filtered)",
    }
    protocol = beside = ""
    if results:
        # Each method sets its scans per place.
        shared = replace(results[0].protocol, scans_per_place=None, place=None)
        protocol = shared.to_text() + _merging_text(results)
    if any(map(reference.covers, results)):
        beside = f" In brackets or small: the value of {reference.title}."
    return Table(
        (
            "map",
            "DB → query",
            "TCR_sym",
            "visible change",
            *tuple(measures) * len(methods),
        ),
        tuple(rows),
        groups=(
            ("", 4),
            *((title(method), len(measures)) for method in methods),
        ),
        caption=f"Place recognition{captions[mode]}. {protocol}{beside}"
        " Strict: the AUC with recall = TP / N, which wrong accepted answers"
        " lower, too. Bold: best of a row; underlined: second. Beside"
        " visible change: the same minus that of the control.",
    )


def _merging_text(results: Sequence[PlaceOutcome]) -> str:
    """Returns a sentence on which of several merged scans is the place.

    It is empty if no scans are merged.
    """
    methods: dict[str, list[str]] = {}
    for one in in_table_order(result.method for result in results):
        (place,) = {
            result.protocol.place for result in results if result.method == one
        }
        if place is not None:
            methods.setdefault(place, []).append(title(one))
    if not methods:
        return ""
    chosen = " and ".join(
        f"the {place} scan ({', '.join(names)})"
        for place, names in methods.items()
    )
    return f" Where scans are merged, {chosen} gives the place its pose."


def audit_table(
    results: Sequence[PlaceOutcome], reference: Reference = NO_REFERENCE
) -> Table:
    """Returns a table of all metrics with the counts from which they follow.

    The table has a row for each result and mode (all queries, or only queries
    with a match).

    Args:
        results: results of methods on pairs of drives.
        reference: published results to put next to them.
    """
    return Table.of(
        [_Counted.of(r, mode, reference) for r in results for mode in MODES],
        {
            "map": lambda c: c.result.pair[0],
            "DB → query": lambda c: " → ".join(c.result.pair[1:]),
            "method": lambda c: c.result.method,
            "mode": lambda c: c.metrics.mode,
            "AUC": lambda c: c.metrics.auc,
            "AUC low": lambda c: c.metrics.auc_interval.low,
            "AUC high": lambda c: c.metrics.auc_interval.high,
            "paper's AUC": lambda c: c.printed and c.printed.auc,
            "AUC strict": lambda c: c.metrics.auc_strict,
            "R@1": lambda c: c.metrics.recall_at_1,
            "R@1 low": lambda c: c.metrics.recall_at_1_interval.low,
            "R@1 high": lambda c: c.metrics.recall_at_1_interval.high,
            "paper's R@1": lambda c: c.printed and c.printed.recall_at_1,
            "R@5": lambda c: float(c.metrics.recall_at_n[4]),
            "R@25": lambda c: float(c.metrics.recall_at_n[24]),
            "R@1%": lambda c: float(c.metrics.recall_at_1_percent),
            "F1max": lambda c: c.metrics.f1_max,
            "paper's F1": lambda c: c.printed and c.printed.f1_max,
            "queries": lambda c: c.metrics.num_queries,
            "N (with a match)": lambda c: c.metrics.num_with_match,
            "TP of R@1": lambda c: c.metrics.num_right,
            "TP of F1max": lambda c: c.at_f1_max(
                c.metrics.curve.true_positives
            ),
            "T of F1max": lambda c: c.at_f1_max(c.metrics.curve.counted),
            **protocol_columns("result."),
        },
        CAPTIONS["audit"],
    )


def metric_numbers(results: Sequence[PlaceOutcome]) -> Table:
    """Returns the metrics that other publications use, for `metrics.csv`."""
    return Table.of(
        by_pair_and_method(results),
        {
            **_KEYS,
            "auc_strict": lambda r: r.by_mode["all"].auc_strict,
            "recall_at_1": lambda r: r.outcomes.recall_at(1),
            "recall_at_1_percent": lambda r: r.outcomes.recall_at(
                r.outcomes.one_percent_rank
            ),
            "mean_reciprocal_rank": lambda r: r.outcomes.mean_reciprocal_rank,
            "recall_at_full_precision": lambda r: (
                r.by_mode["all"].curve.recall_at_full_precision
            ),
            "match_auroc": lambda r: r.outcomes.match_auroc,
            "pose_success": lambda r: r.pose.success,
            **keyed(
                {f"auc_within_{radius:g}_m": radius for radius in RADII},
                lambda r, radius: r.auc_over_radius()[radius],
            ),
            **_PROTOCOL,
        },
    )


class MethodDifference(NamedTuple):
    """The AUC of a method minus the AUC of another, on a pair of drives.

    Attributes:
        result: result of the first method.
        other: result of the second method.
        difference: the difference.
        p_value: p-value of the difference, corrected for the number of
            differences on this pair of drives; NaN if unknown.
    """

    result: PlaceOutcome
    other: PlaceOutcome
    difference: Difference
    p_value: float


def method_differences(
    results: Sequence[PlaceOutcome],
) -> list[MethodDifference]:
    """Returns the AUC difference of any two methods on each pair of drives.

    All queries count (mode `all`).
    """
    found: list[MethodDifference] = []
    for some in by_pair(by_pair_and_method(results)).values():
        compared = compared_by_auc(
            {k: [one.outcomes] for k, one in enumerate(some)}
        )
        found += [
            MethodDifference(some[a], some[b], difference, p)
            for (a, b), (difference, p) in compared.items()
        ]
    return found


def difference_numbers(differences: Sequence[MethodDifference]) -> Table:
    """Returns the AUC differences between methods, for `differences.csv`."""
    return Table.of(
        differences,
        {
            **_inner({n: _KEYS[n] for n in ("map", "db", "query")}),
            "gate": lambda d: d.result.protocol.gate,
            "method_a": lambda d: d.result.method,
            "method_b": lambda d: d.other.method,
            "difference": lambda d: d.difference.value,
            "low": lambda d: d.difference.interval.low,
            "high": lambda d: d.difference.interval.high,
            "p": lambda d: d.p_value,
            "protocol": lambda d: d.result.protocol_name,
        },
    )


def difference_table(differences: Sequence[MethodDifference]) -> Table:
    """Returns the AUC differences between methods, for print."""
    names = "map", "DB → query"
    return Table.of(
        differences,
        {
            **_inner({name: _SHOWN[name] for name in names}),
            "method A": lambda d: title(d.result.method),
            "method B": lambda d: title(d.other.method),
            "A - B": lambda d: d.difference.value,
            "low": lambda d: d.difference.interval.low,
            "high": lambda d: d.difference.interval.high,
            "p": lambda d: d.p_value,
        },
        CAPTIONS["differences"],
    )


# Name in files -> value.
_POSE_ERRORS: Columns[PlaceOutcome] = {
    "translation_median": lambda r: r.pose.translation_median,
    "translation_90": lambda r: r.pose.translation_90,
    "rotation_median_deg": lambda r: r.pose.rotation_median_deg,
    "rotation_90_deg": lambda r: r.pose.rotation_90_deg,
    "success": lambda r: r.pose.success,
    "recall_at_full_precision": lambda r: (
        r.by_mode["all"].curve.recall_at_full_precision
    ),
}


def pose_table(results: Sequence[PlaceOutcome]) -> Table:
    """Returns a table of the errors of estimated poses, for print."""
    names: list[str | tuple[str, str]] = [
        *(("translation [m]", part) for part in ("median", "90 %")),
        *(("rotation [deg]", part) for part in ("median", "90 %")),
        "success",
        "recall at full precision",
    ]
    return Table.of(
        by_pair_and_method(results),
        {**_SHOWN, **dict(zip(names, _POSE_ERRORS.values(), strict=True))},
        CAPTIONS["poses"],
    )


def sessions_table(results: Sequence[PlaceOutcome]) -> Table:
    """Returns a table of databases of several drives, for print."""
    return Table.of(
        by_pair_and_method(results),
        {
            **_SHOWN,
            "places": lambda r: len(r.place_frames),
            "AUC": lambda r: r.by_mode["all"].auc,
            "strict": lambda r: r.by_mode["all"].auc_strict,
            "R@1": lambda r: r.by_mode["all"].recall_at_1,
        },
        CAPTIONS["sessions"],
    )


def pose_error_numbers(results: Sequence[PlaceOutcome]) -> Table:
    """Returns a table of the errors of estimated poses, for `poses.csv`."""
    return Table.of(
        results,
        {
            **_KEYS,
            "accepted_matches": lambda r: r.pose.num_accepted,
            **_POSE_ERRORS,
            **_PROTOCOL,
        },
    )


class _Faults(NamedTuple):
    """Why top-ranked places are wrong: reasons, and changed classes."""

    result: PlaceOutcome
    kinds: Counter[str]
    changed: Counter[str]

    @property
    def wrong(self) -> int:
        """Number of wrong top-ranked places of queries that have a match."""
        return self.kinds.total() - self.kinds["no_place"]

    @property
    def elsewhere(self) -> int:
        """Number of all kinds of the reason `elsewhere`, as in tables."""
        return sum(self.kinds[kind] for kind in ELSEWHERE_KINDS)


def fault_table(results: Sequence[PlaceOutcome], evidence: Evidence) -> Table:
    """Returns a table, for print, on why top-ranked places are wrong."""

    def share(one: _Faults, kind: str) -> str | None:
        part = one.kinds[kind] / max(one.wrong, 1)
        return f"{100.0 * part:.0f} %" if part else None

    return Table.of(
        _count_faults(results, evidence),
        {
            **_inner(_SHOWN),
            "wrong": lambda one: one.wrong,
            **keyed({fault_words(k): k for k in FAULT_KINDS[1:]}, share),
            "changed by": lambda one: (
                ", ".join(
                    f"{n} {name}" for name, n in one.changed.most_common()
                )
                or None
            ),
        },
        CAPTIONS["faults"],
    )


def fault_numbers(results: Sequence[PlaceOutcome], evidence: Evidence) -> Table:
    """Returns the table `why.csv`: why top-ranked places were wrong.

    For each method on each pair of drives, the table counts the queries with a
    wrong top-ranked place, by reason.
    """
    return Table.of(
        _count_faults(results, evidence),
        {
            **_inner(_KEYS),
            "queries": lambda one: len(one.result.outcomes),
            "wrong": lambda one: one.wrong,
            **keyed(
                {kind: kind for kind in FAULT_KINDS},
                lambda one, kind: one.kinds[kind],
            ),
            ELSEWHERE: lambda one: one.elsewhere,
            "changed_by": lambda one: (
                " ".join(f"{name}:{n}" for name, n in one.changed.most_common())
                or None
            ),
            **protocol_columns("result."),
        },
    )


def _count_faults(
    results: Sequence[PlaceOutcome], evidence: Evidence
) -> Iterator[_Faults]:
    for result in by_pair_and_method(results):
        known = evidence.get((result.database, result.query))
        if known is None:
            continue
        kinds = fault_kinds(result, known)
        yield _Faults(
            result,
            Counter(filter(None, kinds)),
            Counter(
                name
                for kind, name in zip(kinds, known.changed_classes, strict=True)
                if kind == "changed"
            ),
        )


def cost_table(costs: Sequence[Cost]) -> Table:
    """Returns the table of the methods' costs, with a row for each method."""
    by_method = {cost.method: cost for cost in costs}
    return Table.of(
        map(by_method.__getitem__, in_table_order(by_method)),
        {
            "method": lambda c: title(c.method),
            "scans a place": lambda c: c.scans_per_place,
            "points": lambda c: f"{c.points:.0f}",
            "describe [ms]": lambda c: f"{c.describe_ms:.1f}",
            "query [ms]": lambda c: f"{c.query_ms:.1f}",
            "of places": lambda c: c.places,
            "bytes a place": lambda c: f"{c.place_bytes:.0f}",
        },
        CAPTIONS["costs"],
    )


def cost_numbers(costs: Sequence[Cost]) -> Table:
    """Returns `costs.csv`: the fields of `Cost`, a row for each method."""
    return Table.of(costs, {f.name: attrgetter(f.name) for f in fields(Cost)})


@dataclass(frozen=True)
class DriveTrack:
    """Time stamps and sensor poses of all frames of a drive.

    Attributes:
        stamps_ns: (N,) int64 time stamps [ns].
        X_WS: (N, 4, 4) poses of the sensor.
    """

    stamps_ns: np.ndarray
    X_WS: np.ndarray

    def moments(self, frames: np.ndarray) -> list[np.ndarray]:
        """Returns number, time stamp and sensor pose of given frames.

        Args:
            frames: (Q,) frame numbers; a number below 0 stands for no frame.

        Returns:
            Nine arrays (Q,) of objects: frame, stamp [ns], x, y, z [m], and qx,
            qy, qz, qw of the orientation. All values are None where there is no
            frame.
        """
        X_WS = self.X_WS[frames]
        quats_xyzw = Rotation.from_matrix(X_WS[:, :3, :3]).as_quat()
        poses = np.concatenate([X_WS[:, :3, 3], quats_xyzw], axis=1)
        columns = [
            column.astype(object)
            for column in (frames, self.stamps_ns[frames], *poses.T)
        ]
        for column in columns:
            column[frames < 0] = None
        return columns


class _Queries(NamedTuple):
    """Queries and their top-ranked places: frame, time and pose."""

    result: PlaceOutcome
    query: list[np.ndarray]
    match: list[np.ndarray]
    evidence: PairEvidence | None


def _moment_columns(side: str) -> Columns[_Queries]:
    return keyed(
        {f"{side}_{name}": k for k, name in enumerate(_MOMENT)},
        lambda q, k: getattr(q, side)[k],
    )


_QUERY_COLUMNS: Columns[_Queries] = {
    **_inner(_KEYS),
    "correct": lambda q: q.result.outcomes.is_right,
    "has_match": lambda q: q.result.outcomes.has_match,
    "score": lambda q: q.result.outcomes.best_scores,
    "first_right_rank": lambda q: q.result.outcomes.known_ranks,
    "places": lambda q: q.result.outcomes.num_places,
    "block": lambda q: q.result.outcomes.own_blocks,
    "query_drive": lambda q: q.result.query,
    **_moment_columns("query"),
    "match_drive": lambda q: q.result.database,
    **_moment_columns("match"),
    "distance": lambda q: q.result.columns["distance"],
    "translation_error": lambda q: q.result.pose_errors.translation,
    "rotation_error_deg": lambda q: q.result.pose_errors.rotation_deg,
    **keyed(
        {name: name for name in PROTOCOL_COLUMNS},
        lambda q, name: getattr(q.result.protocol, name),
    ),
    "why": lambda q: q.evidence and fault_kinds(q.result, q.evidence),
    "overlap": lambda q: q.evidence and q.evidence.overlaps,
    "hidden": lambda q: q.evidence and q.evidence.hidden_shares,
    "changed": lambda q: q.evidence and q.evidence.changed,
    "changed_class": lambda q: q.evidence and q.evidence.changed_classes,
    "right_fit": lambda q: q.evidence and q.evidence.right_fits,
    "wrong_fit": lambda q: q.evidence and q.evidence.fits[q.result.method],
    "visible_change": lambda q: q.evidence and q.evidence.visible_changes,
    "protocol": attrgetter("result.protocol_name"),
}


def query_table(
    results: Iterable[PlaceOutcome],
    tracks: Mapping[str, DriveTrack],
    evidence: Evidence,
) -> Table:
    """Returns a table with a row for each query of each result.

    Rows are in the order of `results`.

    Args:
        results: results of methods on pairs of drives.
        tracks: drive -> its frames, for all drives in the results.
        evidence: names of database and query drive -> evidence on why
            top-ranked places are wrong. The columns with reasons are empty for
            a pair without evidence.
    """

    def queries(one: PlaceOutcome) -> _Queries:
        return _Queries(
            one,
            tracks[one.query].moments(one.columns["query_frame"]),
            tracks[one.database].moments(one.columns["match_frame"]),
            evidence.get((one.database, one.query)),
        )

    return Table.of(map(queries, results), _QUERY_COLUMNS)
