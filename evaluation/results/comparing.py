"""Compares your tables of results with the shipped tables."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
import functools
import itertools
from pathlib import Path
import re
from typing import Any, NamedTuple
import warnings

import numpy as np
from scipy.stats import kendalltau

from cns_drake.base.errors import InputError
from cns_drake.base.json_text import json_values
from evaluation.recognition.bootstrap import (
    Interval,
    percentile_interval,
    resampled_metrics,
    weights_by_drive,
)
from evaluation.recognition.metrics import main_metrics
from evaluation.recognition.protocol import PROTOCOL_NAMES, PROTOCOLS
from evaluation.recognition.significance import Difference, compared_by_auc
from evaluation.results.summaries import (
    LEAST_UNITS,
    Ranked,
    check_same_queries,
    drive_number,
    ranking,
)
from evaluation.results.table import (
    KEYS,
    LAST,
    QUERIES,
    RESULTS,
    SETTINGS,
    STAGE,
    Answers,
    QueryRows,
    Results,
    Row,
)

_BASELINES = Path(__file__).with_name("baselines")
_SHIPPED = "shipped"
# Metrics for which less is better.
_LESS = re.compile(
    r"translation_\w+|rotation_\w+|\w+_ms|no_\w+|other_city|too_far|elsewhere"
    r"|lost|memory|\w+_time"
)
# Metric -> its index in the result of `resampled_metrics`.
_RESAMPLED = {"auc": 0, "r1": 1}

# Metrics that are computed from answers to queries.
_RECOMPUTED = ("auc", "r1", "auc_strict")
# Values that differ by no more are the same result, with the digits that ship.
_ALIKE = 1e-4
# The same for a value and its answers, for tables that were rounded by hand.
_AGREED = 1e-3

# A method, and what identifies a condition.
_Place = tuple[str, tuple[object, ...]]


@dataclass(frozen=True)
class _Table:
    """A table's rows of one metric, and its answers to queries, if any."""

    name: str
    rows: Mapping[_Place, Row]
    answers: Mapping[_Place, Answers]

    @property
    def methods(self) -> list[str]:
        return list(dict.fromkeys(method for method, _ in self.rows))

    @property
    def conditions(self) -> list[tuple[object, ...]]:
        return list(dict.fromkeys(condition for _, condition in self.rows))


class Compared(NamedTuple):
    """The mean AUC of one method minus the mean AUC of another.

    Attributes:
        first, second: names of the two methods.
        difference: the difference.
        p_value: p-value of the difference, corrected by Holm's method for the
            number of differences in the comparison.
    """

    first: str
    second: str
    difference: Difference
    p_value: float


class Agreement(NamedTuple):
    """How similarly two tables rank the methods that are in both tables.

    Attributes:
        first, second: names of the two tables.
        methods: names of these methods.
        tau: Kendall's tau-b (Kendall, Biometrika 33, 1945): 1 if the two tables
            rank the methods in the same order, -1 if they rank them in opposite
            orders; NaN if all values of a table are equal.
        interval: 95 % interval of `tau`.
    """

    first: str
    second: str
    methods: tuple[str, ...]
    tau: float
    interval: Interval


@dataclass(frozen=True)
class Comparison:
    """The result of comparing tables.

    Attributes:
        metric: the number that is compared.
        task: the task to which this number belongs.
        conditions: number of the conditions that all tables have; 0 for
            rankings.
        ranked: methods, the best first. If a method is in two tables, or is
            also shipped, the name of the table is appended to its name. If only
            rankings are compared, each table is ranked over its own conditions.
        differences: differences between any two methods whose answers to all
            queries are known.
        agreements: how similarly any two tables rank their methods, if they
            have at least two method names in common.
        notes: what was left out.
    """

    metric: str
    task: str
    conditions: int
    ranked: Sequence[Ranked]
    differences: Sequence[Compared]
    agreements: Sequence[Agreement]
    notes: Sequence[str]

    def to_json(self) -> dict[str, Any]:
        """Returns the whole comparison as a dictionary for JSON.

        NaN becomes None.
        """
        return {
            "metric": self.metric,
            "task": self.task,
            "conditions": self.conditions,
            "methods": [
                {
                    "method": one.method,
                    "value": one.value,
                    "interval_95": one.interval.to_json(),
                }
                for one in self.ranked
            ],
            "differences": [
                {
                    "first": one.first,
                    "second": one.second,
                    "difference": one.difference.value,
                    "interval_95": one.difference.interval.to_json(),
                    "p": json_values(one.p_value),
                }
                for one in self.differences
            ],
            "agreements": [
                {
                    "first": one.first,
                    "second": one.second,
                    "methods": list(one.methods),
                    "kendall_tau": json_values(one.tau),
                    "interval_95": one.interval.to_json(),
                }
                for one in self.agreements
            ],
            "notes": list(self.notes),
        }


def compare(
    paths: Sequence[Path],
    metric: str = "auc",
    protocol: str | None = None,
    *,
    gate: bool = False,
    rankings: bool = False,
) -> Comparison:
    """Compares tables of results with one another and the shipped tables.

    Args:
        paths: tables of results, or folders with a `results.csv`. The answers
            to queries in a `queries.csv` next to a table are used as well.
        metric: the metric to compare. If several tasks have it, the results of
            `place` are compared.
        protocol: name of the protocol whose rows count. By default, rows of the
            same protocol are compared. With `rankings`, the default is `fair`
            or, in a table without this protocol, the table's only protocol.
            Rows whose protocols differ in anything that changes a number (see
            `RetrievalProtocol.digest`) are never compared.
        gate: whether to compare the rows that were measured with geometric
            verification (true) or without (false).
        rankings: whether to compare only the order of the methods in these
            tables, without the shipped tables. The tables need no condition in
            common; one can contain simulated drives and another real drives.

    Raises:
        InputError: a table cannot be read, has no such row, contradicts the
            answers beside it, or the tables have no condition in common.
    """
    if protocol not in (None, *PROTOCOL_NAMES):
        names = ", ".join(PROTOCOL_NAMES)
        raise InputError(f"--protocol: {protocol!r} is none of {names}")
    read = [Results.read(path) for path in paths]
    tasks = {row.task for one in read for row in one.where(metric=metric).rows}
    task = "place" if "place" in tasks else min(tasks, default="")
    wanted: dict[str, object] = {"metric": metric, "task": task, "gate": gate}
    if protocol is not None:
        wanted["protocol"] = protocol
    own: list[_Table] = []
    notes: list[str] = []
    for path, results in zip(paths, read, strict=True):
        chosen_rows = results.where(wanted).rows
        if not chosen_rows:
            with_or = "with" if gate else "without"
            chosen = f"{metric} {with_or} geometric verification"
            by = f" by protocol {protocol}" if protocol else ""
            known = ", ".join(sorted(results.distinct("metric")))
            raise InputError(
                f"{path}: no row of {chosen}{by} (metrics: {known})"
            )
        if rankings and protocol is None:
            chosen_rows = _by_one_protocol(chosen_rows, path)
        if any(not row.protocol_digest for row in chosen_rows):
            notes.append(
                f"{path}: rows do not say how they were made (column"
                " protocol_digest); taken for the shipped protocol of this name"
            )
        queries = (path if path.is_dir() else path.parent) / QUERIES
        answers = QueryRows.read(queries).answers if queries.is_file() else ()
        _check_agreement(queries, answers, path, results)
        asked = [a for a in answers if (a.task, a.gate) == (task, gate)]
        if metric in _RESAMPLED and any(
            a.outcomes.blocks is None for a in asked
        ):
            notes.append(
                f"{queries}: without blocks of the route (column block),"
                " intervals are too narrow"
            )
        own.append(
            _Table(
                _table_name(path, paths),
                _by_place(chosen_rows),
                _by_place(asked),
            )
        )
    less = bool(_LESS.fullmatch(metric))
    if rankings:
        if len(own) < 2:
            raise InputError("--rankings: two tables are needed")
        for k, table in enumerate(own):
            changed, left = _without_controls(table.conditions)
            own[k] = _reduced_to(table, changed)
            notes += [f"{table.name}: {one}" for one in left]
        pairs = itertools.combinations(own, 2)
        found = [_agreement(*pair, metric) for pair in pairs]
        each = [
            one._replace(method=f"{one.method} ({table.name})")
            for table in own
            for one in ranking(table.rows.values(), least_first=less)[0]
        ]
        return Comparison(metric, task, 0, each, (), found, notes)
    shipped = _shipped(wanted)
    common, apart = _common_conditions(own, shipped, paths)
    common, left_out = _without_controls(common)
    notes += [*apart, *left_out]
    tables = [_reduced_to(table, common) for table in (shipped, *own)]
    entries, left_out = _ranked_entries(tables, common)
    notes += [*left_out, *_mismatch_notes(entries, common)]
    rows = [
        replace(table.rows[method, one], method=name)
        for name, (table, method) in entries.items()
        for one in common
    ]
    ranked, _ = ranking(rows, least_first=less)
    alike = [
        _agreement(*pair, metric)
        for pair in itertools.combinations(tables, 2)
        if len({*pair[0].methods} & {*pair[1].methods}) > 1
    ]
    differences = _differences(entries, common) if metric == "auc" else ()
    return Comparison(
        metric, task, len(common), ranked, differences, alike, notes
    )


def _table_name(path: Path, paths: Iterable[Path]) -> str:
    """Returns the name of a table: the name of its file or folder."""
    names = [
        one.stem
        if one.is_file() and one.name != RESULTS
        # A folder, or the file that it holds.
        else (one if one.is_dir() else one.parent).absolute().name
        for one in (path, *paths)
    ]
    name = names.pop(0)
    return name if names.count(name) < 2 else str(path)


def _by_one_protocol(rows: Sequence[Row], path: Path) -> tuple[Row, ...]:
    names = list(dict.fromkeys(row.protocol for row in rows))
    if "fair" not in names and len(names) > 1:
        raise InputError(
            f"{path}: protocol: {' and '.join(names)} in one table; choose one"
            " with --protocol"
        )
    chosen = "fair" if "fair" in names else names[0]
    return tuple(row for row in rows if row.protocol == chosen)


def _by_place(keys: Iterable[Any]) -> dict[_Place, Any]:
    """Returns (method with settings, condition) -> row or answers.

    An unknown digest of a protocol is taken for that of the shipped protocol.
    """
    found = {}
    for key in keys:
        factors = {
            name: value
            for name, value in key.factors.items()
            if not name.startswith(SETTINGS)
        }
        digest = key.protocol_digest
        if not digest and key.protocol in PROTOCOLS:
            digest = PROTOCOLS[key.protocol].digest()
        plain = replace(
            key, method=key.label, factors=factors, protocol_digest=digest
        )
        found[plain.method, plain.but("method")] = plain
    return found


def _check_agreement(
    queries: Path, answers: Iterable[Answers], path: Path, results: Results
) -> None:
    """Checks that answers to queries give the results beside them.

    Raises:
        InputError: a result differs, or the number of queries.
    """
    known = {
        (*row.but(), row.metric): row
        for row in results.where(task="place").rows
    }
    for one in answers:
        # Areas take time, and other tasks have none.
        if one.task != "place" or not any(
            (*one.but(), name) in known for name in _RECOMPUTED
        ):
            continue
        for name, value in main_metrics(one.outcomes).items():
            row = known.get((*one.but(), name))
            number = len(one.outcomes)
            if row is None or (
                abs(row.value - value) <= _AGREED and row.n in (None, number)
            ):
                continue
            count = "" if row.n is None else f" of {row.n} queries"
            raise InputError(
                f"{queries}: contradicts {path}: {name} of {one.label},"
                f" {one.database} -> {one.query}: {value:.4f} of {number}"
                f" queries, but {row.value:.4f}{count} in the results"
            )


def _ranked_entries(
    tables: Sequence[_Table], common: Sequence[tuple[object, ...]]
) -> tuple[dict[str, tuple[_Table, str]], list[str]]:
    """Returns the methods to rank by their names, and notes on the others.

    A method with the same results in two tables is there once. If the results
    differ, the name of a table is appended to the name of its method.

    Args:
        tables: the shipped tables, followed by the user's.
        common: the conditions that all tables have.
    """
    notes = []
    kept: list[tuple[_Table, str]] = []
    # The user's tables come first: they may hold answers to queries.
    for table in (*tables[1:], tables[0]):
        for method in table.methods:
            has = sum((method, one) in table.rows for one in common)
            if has < len(common):
                is_once = sum(method in one.methods for one in tables) == 1
                name = method if is_once else f"{method} ({table.name})"
                notes.append(
                    f"{name}: left out, with {has} of {len(common)} conditions"
                )
                continue
            same = [
                other.name
                for other, name in kept
                if name == method
                and all(
                    abs(
                        other.rows[method, one].value
                        - table.rows[method, one].value
                    )
                    <= _ALIKE
                    for one in common
                )
            ]
            if same:
                notes.append(
                    f"{method}: the same in {same[0]} and {table.name}; shown"
                    " once"
                )
            else:
                kept.append((table, method))
    counts = Counter(method for _, method in kept)
    # In the order of the tables, as ties are shown.
    kept.sort(key=lambda one: tables.index(one[0]))
    return {
        f"{method} ({table.name})"
        if table is not tables[0] and counts[method] > 1
        else method: (table, method)
        for table, method in kept
    }, notes


def _mismatch_notes(
    entries: Mapping[str, tuple[_Table, str]],
    common: Sequence[tuple[object, ...]],
) -> Iterator[str]:
    """Yields notes on results that are not of the same queries or version."""
    rows = {
        name: [table.rows[method, one] for one in common]
        for name, (table, method) in entries.items()
    }
    unknown = [
        name for name, some in rows.items() if any(r.n is None for r in some)
    ]
    if unknown and len(unknown) < len(rows):
        yield f"{', '.join(unknown)}: of how many queries is not known"
    for some in zip(*rows.values(), strict=True):
        numbers: dict[int, str] = {}
        for name, row in zip(rows, some, strict=True):
            if row.n is not None:
                numbers.setdefault(row.n, name)
        if len(numbers) > 1:
            each = ", ".join(f"{n} ({name})" for n, name in numbers.items())
            yield (
                f"{some[0].database} -> {some[0].query}: not the same queries:"
                f" {each}; their values are of different difficulty"
            )
            break
    versions = {row.version for some in rows.values() for row in some} - {""}
    if len(versions) > 1:
        yield f"measured by versions {', '.join(sorted(versions))}"


def _shipped(wanted: Mapping[str, object]) -> _Table:
    rows = [row for one in _baselines() for row in one.where(wanted).rows]
    return _Table(_SHIPPED, _by_place(rows), {})


@functools.cache
def _baselines() -> list[Results]:
    """Returns the shipped tables."""
    return [Results.read(path) for path in sorted(_BASELINES.glob("*.csv"))]


def _common_conditions(
    own: Sequence[_Table], shipped: _Table, paths: Sequence[Path]
) -> tuple[list[tuple[object, ...]], list[str]]:
    """Returns the conditions that all tables have, and notes for the user."""
    common = own[0].conditions
    for table in own[1:]:
        common = [one for one in common if one in set(table.conditions)]
    with_shipped = [one for one in common if one in set(shipped.conditions)]
    if with_shipped:
        others = (*own, shipped)
        return with_shipped, _left_out(own, others, with_shipped)
    if len(own) > 1 and common:
        notes = _left_out(own, own, common)
        return common, [
            *notes,
            "the shipped tables have none of these conditions",
        ]
    names = ", ".join(map(str, paths))
    others = (*own[1:], *([] if own[1:] else [shipped]))
    beside = "" if len(own) > 1 else " with the shipped tables"
    why = _why_nothing_is_common(own[0], others[0])
    raise InputError(f"{names}: no condition in common{beside} ({why})")


def _left_out(
    own: Sequence[_Table],
    tables: Sequence[_Table],
    common: Iterable[tuple[object, ...]],
) -> list[str]:
    """Returns notes on the conditions of tables that another one lacks."""
    kept = set(common)
    notes: Counter[str] = Counter()
    for table in own:
        left = {c: r for (_, c), r in table.rows.items() if c not in kept}
        for condition, row in left.items():
            other = next(
                one
                for one in tables
                if one is not table and condition not in set(one.conditions)
            )
            wanted = row.but("method", "protocol")
            alike = [
                one
                for one in other.rows.values()
                if one.but("method", "protocol") == wanted
            ]
            name = (
                "the shipped tables" if other.name == _SHIPPED else other.name
            )
            lack = "lack" if other.name == _SHIPPED else "lacks"
            why = f"as {name} {lack} them"
            if alike:
                why = (
                    f"by protocol {_protocol_text(row)}, not"
                    f" {_protocol_text(alike[0])} in {name}"
                )
            notes[f"{table.name}: left out, {why}"] += 1
    return [f"{why}: {count} conditions" for why, count in notes.items()]


def _protocol_text(row: Row) -> str:
    return f"{row.protocol} ({row.protocol_digest or 'unknown'})"


def _without_controls(
    conditions: list[tuple[object, ...]],
) -> tuple[list[tuple[object, ...]], list[str]]:
    """Leaves out conditions without a change; returns the others, and a note.

    If there is no change in any condition, all of them are returned.
    """
    changed = [one for one in conditions if (STAGE, LAST) not in one]
    left = len(conditions) - len(changed)
    if not left or not changed:
        return conditions, []
    return changed, [
        f"left out, as nothing changes in them ({STAGE} {LAST}): {left}"
        " conditions"
    ]


def _why_nothing_is_common(one: _Table, other: _Table) -> str:
    """Returns as text why two tables have no condition in common."""
    rows = [list(table.rows.values()) for table in (one, other)]
    factors = {
        name: None for some in rows for row in some for name in row.factors
    }
    for column in (*(name for name in KEYS if name != "version"), *factors):
        first, second = (
            sorted({str(row[column]) for row in some}) for some in rows
        )
        if column != "method" and not {*first} & {*second}:
            return (
                f"{column}: {', '.join(first[:3])} in {one.name}, but"
                f" {', '.join(second[:3])} in {other.name}"
            )
    return "each value is in both, but no row has the same ones in all columns"


def _reduced_to(table: _Table, common: Iterable[tuple[object, ...]]) -> _Table:
    """Returns a table reduced to some of its conditions."""
    kept = set(common)
    rows = {place: row for place, row in table.rows.items() if place[1] in kept}
    return replace(table, rows=rows)


def _differences(
    entries: Mapping[str, tuple[_Table, str]],
    common: Sequence[tuple[object, ...]],
) -> list[Compared]:
    """Compares any two methods that have answers in all conditions."""
    asked: dict[str, list[Answers]] = {}
    for name, (table, method) in entries.items():
        places = [(method, one) for one in common]
        if all(place in table.answers for place in places):
            asked[name] = [table.answers[place] for place in places]
    for one, *others in zip(*asked.values(), strict=True):
        for other in others:
            check_same_queries(one, other)
    compared = compared_by_auc(
        {name: [a.outcomes for a in some] for name, some in asked.items()},
        [drive_number(a) for a in next(iter(asked.values()), ())],
    )
    return [Compared(*two, *found) for two, found in compared.items()]


def _agreement(first: _Table, second: _Table, metric: str) -> Agreement:
    """Compares the rankings of two tables, each of its own conditions.

    The interval is by bootstrap, which draws the maps of a table that has four
    or more: a ranking is to hold on other maps, too. Of fewer maps it draws
    blocks of the routes if the answers to all queries are known, and otherwise
    the units of `ranking`.

    Raises:
        InputError: fewer than two methods have results in all conditions of
            both tables.
    """
    whole = [
        {
            method
            for method in table.methods
            if all((method, one) in table.rows for one in table.conditions)
        }
        for table in (first, second)
    ]
    methods = tuple(sorted(set.intersection(*whole)))
    if len(methods) < 2:
        raise InputError(
            f"{first.name}, {second.name}: fewer than two methods are on all"
            f" conditions of both ({', '.join(methods) or 'none'})"
        )
    one, one_samples = _means_and_samples(first, methods, metric)
    other, other_samples = _means_and_samples(second, methods, metric)
    samples = zip(one_samples, other_samples, strict=True)
    taus = np.array([_tau(*pair) for pair in samples])
    return Agreement(
        first.name,
        second.name,
        methods,
        _tau(one, other),
        percentile_interval(taus),
    )


def _means_and_samples(
    table: _Table, methods: Sequence[str], metric: str
) -> tuple[np.ndarray, np.ndarray]:
    """Returns means (M,) of methods, and their bootstrap samples (B, M)."""
    ranked, samples = ranking(
        row for (method, _), row in table.rows.items() if method in methods
    )
    order = [[one.method for one in ranked].index(name) for name in methods]
    means = np.array([one.value for one in ranked])[order]
    places = list(itertools.product(table.conditions, methods))
    if (
        len({row.map for row in table.rows.values()}) >= LEAST_UNITS
        or metric not in _RESAMPLED
        or any((method, one) not in table.answers for one, method in places)
    ):
        return means, samples[:, order]
    asked = [
        [table.answers[method, one] for method in methods]
        for one in table.conditions
    ]
    for some in asked:
        for answers in some:
            check_same_queries(some[0], answers)
    drawn = weights_by_drive(
        [some[0].outcomes.own_blocks for some in asked],
        [drive_number(some[0]) for some in asked],
    )
    of_condition = [
        [
            resampled_metrics(answers.outcomes, weights)[_RESAMPLED[metric]]
            for answers in some
        ]
        for some, (_, weights) in zip(asked, drawn, strict=True)
    ]
    return means, np.mean(of_condition, axis=0).T


def _tau(first: np.ndarray, second: np.ndarray) -> float:
    with warnings.catch_warnings():
        # SciPy warns if all values are equal; the result is then NaN.
        warnings.simplefilter("ignore")
        return float(kendalltau(first, second).statistic)
