"""Compares your tables of results with each other and with shipped tables."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
import itertools
import math
from pathlib import Path
import re
from typing import Any, NamedTuple
import zlib

import numpy as np

from evaluation.base import (
    InputError,
    doing,
    json_values,
    no_such,
    value_errors,
)
from evaluation.recognition import (
    LEAST_CITIES,
    METRICS,
    PROTOCOL_NAMES,
    SIGNIFICANT,
    UNKNOWN,
    Difference,
    Interval,
    Metric,
    common_blocks,
    compared_by_right_answers,
    load_metrics,
    metric_named,
    sign_flip_test,
)
from evaluation.results.keys import KEYS, LAST, STAGE
from evaluation.results.metric_tables import (
    SHIPPED,
    Condition,
    MetricTable,
    read_metric_table,
    shipped_table,
    shipped_tables,
    table_name,
    table_of,
)
from evaluation.results.ranking import Ranked, rank_methods
from evaluation.results.survival import RELATIVE, Survival, judge_survival
from evaluation.results.table import Answers, Results, Row

# Name of a study's own table.
_STUDY = "this study"
# Values that differ by no more are the same result, with the digits that ship.
_ALIKE = 1e-4
# Metrics whose ranking is followed by the differences of right answers.
_OF_ANSWERS = ("auc", "auc_strict", "r1")
# Up to this number of families, all orders are counted.
_MOST_ENUMERATED = 7
# Number of random orders of more families.
_ORDERS = 9999
# Values of tau that differ by less are equal.
_ROUNDING = 1e-9
# Values that differ by no more can be those of the same program: a rounding
# error that changes an answer changes a share of 100 queries by this.
_ROUNDED = 0.01


class Compared(NamedTuple):
    """The mean R@1 of one method minus the mean R@1 of another.

    Attributes:
        first, second: names of the two methods.
        difference: the difference, whose interval and p-value are corrected
            (Bonferroni) for the number of differences in the comparison.
    """

    first: str
    second: str
    difference: Difference


class _Agreement(NamedTuple):
    """How similarly two tables rank the methods that are in both tables.

    Attributes:
        first, second: names of the two tables.
        methods: names of the methods that are in both tables.
        tau: Kendall's tau-b (Kendall, Biometrika 33, 1945): 1 if the two tables
            rank the methods in the same order, -1 if they rank them in opposite
            orders; NaN if all values of a table are equal.
        families: names of the methods without their settings.
        tau_of_families: Kendall's tau-b over families. The value of a family is
            the mean over its methods: variants of a method are ranked alike, so
            they are no independent evidence.
        interval: 95 % interval of `tau_of_families`, see `_tau_interval`.
        p_value: probability that a random order of the families has a tau of
            this magnitude or a greater one.
    """

    first: str
    second: str
    methods: tuple[str, ...]
    tau: float
    families: tuple[str, ...]
    tau_of_families: float
    interval: Interval
    p_value: float


def _rank_agreement(first: MetricTable, second: MetricTable) -> _Agreement:
    """Compares the rankings of two tables, each over its own conditions."""
    whole = [
        {
            method
            for method in table.methods
            if all(
                (method, condition) in table.rows
                for condition in table.conditions
            )
        }
        for table in (first, second)
    ]
    methods = tuple(sorted(set.intersection(*whole)))
    if len(methods) < 2:
        raise InputError(
            f"{first.name}, {second.name}: fewer than two methods are on all"
            f" conditions of both ({', '.join(methods) or 'none'})"
        )
    means = np.array([_means(table, methods) for table in (first, second)])
    # Settings follow the name of a method.
    names = np.array([re.split("[ ,]", name)[0] for name in methods])
    families = tuple(dict.fromkeys(names.tolist()))
    members = [np.flatnonzero(names == family) for family in families]
    values = np.stack([means[:, some].mean(axis=1) for some in members], axis=1)
    return _Agreement(
        first.name,
        second.name,
        methods,
        float(_kendall_tau(*means)),
        families,
        float(_kendall_tau(*values)),
        _tau_interval(
            (first, second), [[methods[k] for k in some] for some in members]
        ),
        _order_p_value(*values),
    )


def _tau_interval(
    tables: Sequence[MetricTable], families: Sequence[Sequence[str]]
) -> Interval:
    """Returns the 95 % interval of Kendall's tau between families of methods.

    Which of two families is better in a table is known if `sign_flip_test` over
    the maps says so, corrected (Bonferroni) for all pairs of families in both
    tables. Maps are the units, because a ranking should hold on other maps; how
    the queries of a map scatter is part of how maps differ. The interval
    contains each tau that agrees with what is known: it is -1 to 1 if nothing
    is. It is unknown if a table has fewer than eight maps.
    """
    pairs = list(itertools.combinations(range(len(families)), 2))
    if not pairs:
        return UNKNOWN
    known = np.ones(len(pairs))
    for table in tables:
        conditions = table.conditions
        maps = [table.rows[families[0][0], one].map for one in conditions]
        names, of_map = np.unique(maps, return_inverse=True)
        if len(names) < LEAST_CITIES:
            return UNKNOWN
        values = np.array(
            [
                [
                    np.mean([table.rows[name, one].value for name in family])
                    for one in conditions
                ]
                for family in families
            ]
        )
        for k, (i, j) in enumerate(pairs):
            sums = np.bincount(of_map, values[i] - values[j])
            weights = np.bincount(of_map).astype(float)
            # Random patterns of signs must not depend on names.
            order = np.lexsort((sums, weights))
            _, p_value = sign_flip_test(
                sums[order], weights[order], 2 * len(pairs)
            )
            is_known = p_value < SIGNIFICANT and not np.isnan(sums).any()
            known[k] *= np.sign(sums.sum()) if is_known else 0.0
    unknown = np.count_nonzero(known == 0.0)
    return Interval(
        float(known.sum() - unknown) / len(pairs),
        float(known.sum() + unknown) / len(pairs),
    )


def _order_p_value(first: np.ndarray, second: np.ndarray) -> float:
    """Returns the p-value of tau between two lists of values (F,).

    All orders are counted up to seven families, and random ones of more. NaN if
    there is no tau.
    """
    measured = abs(float(_kendall_tau(first, second)))
    if math.isnan(measured):
        return math.nan
    number = len(first)
    if number <= _MOST_ENUMERATED:
        orders = np.array(list(itertools.permutations(range(number))))
        found = np.abs(_kendall_tau(first, second[orders]))
        return float(np.mean(found >= measured - _ROUNDING))
    rng = np.random.default_rng(number)
    orders = np.argsort(rng.random((_ORDERS, number)), axis=1, kind="stable")
    found = np.abs(_kendall_tau(first, second[orders]))
    more = np.count_nonzero(found >= measured - _ROUNDING)
    return (1.0 + more) / (1.0 + _ORDERS)


def _means(table: MetricTable, methods: Sequence[str]) -> list[float]:
    """Returns the means of methods over all conditions of a table."""
    rows = [row for (method, _), row in table.rows.items() if method in methods]
    mean = {one.method: one.value for one in rank_methods(rows)}
    return [mean.get(name, math.nan) for name in methods]


def _kendall_tau(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Returns Kendall's tau-b (...) of two lists of values, (..., N).

    NaN where all values of a list are equal. (SciPy's function is not used,
    because its import would take half of the time of `cns-eval compare`.)
    """
    row, column = np.triu_indices(first.shape[-1], 1)
    x, y = (
        np.sign(values[..., row] - values[..., column])
        for values in (first, second)
    )
    tau = (x * y).sum(axis=-1)
    with np.errstate(invalid="ignore"):
        for signs in (x, y):
            tau = tau / np.sqrt(np.count_nonzero(signs, axis=-1))
    # Rounding may lead out of the range.
    return np.clip(tau, -1.0, 1.0)


@dataclass(frozen=True)
class Comparison:
    """The result of comparing tables.

    Attributes:
        metric: the number that is compared.
        task: the task to which this number belongs.
        conditions: number of the conditions that all tables have; 0 for
            rankings.
        ranked: methods, the best first. If a method is in two tables, or is
            also shipped, the name of the table is appended to the name of the
            method. If only rankings are compared, each table is ranked over its
            own conditions.
        differences: differences between any two methods whose answers to all
            queries are known.
        agreements: how similarly any two tables rank their methods, if they
            have at least two method names in common.
        survival: whether each method survives; empty unless the metric is
            `relative_auc_strict`.
        notes: what was left out.
    """

    metric: str
    task: str
    conditions: int
    ranked: Sequence[Ranked]
    differences: Sequence[Compared]
    agreements: Sequence[_Agreement]
    survival: Sequence[Survival]
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
                    "method": mean.method,
                    "value": mean.value,
                    "interval_95": mean.interval.to_json(),
                }
                for mean in self.ranked
            ],
            "differences": [
                {
                    "first": compared.first,
                    "second": compared.second,
                    "difference": compared.difference.value,
                    "metric": "r1",
                    "interval_95": compared.difference.interval.to_json(),
                    "p": compared.difference.p_value,
                }
                for compared in self.differences
            ],
            "agreements": [
                {
                    "first": agreement.first,
                    "second": agreement.second,
                    "methods": list(agreement.methods),
                    "kendall_tau": json_values(agreement.tau),
                    "families": list(agreement.families),
                    "kendall_tau_families": json_values(
                        agreement.tau_of_families
                    ),
                    "interval_95_families": agreement.interval.to_json(),
                    "p_families": json_values(agreement.p_value),
                }
                for agreement in self.agreements
            ],
            "survival": [one.to_json() for one in self.survival],
            "notes": list(self.notes),
        }


def compare_tables(
    paths: Sequence[Path],
    metric: str = "auc",
    protocol: str | None = None,
    *,
    verified: bool = False,
    rankings: bool = False,
) -> Comparison:
    """Compares tables of results with each other and with the shipped tables.

    Args:
        paths: tables of results, or folders with a `results.csv`. The answers
            to queries in a `queries.csv` next to a table are used as well.
            Without tables, the shipped ones are ranked alone.
        metric: name of the metric to compare, or a Python file that registers
            it. If several tasks have it, the results of `place` are compared.
            If the name is not known, more is taken for better, with a note.
        protocol: name of the protocol whose rows count. By default, rows of the
            same protocol are compared. With `rankings`, the default is
            `random-yaw` or, in a table without this protocol, the table's only
            protocol; without tables, it is `random-yaw`. Rows whose protocols
            differ in anything that changes a number (see
            `RetrievalProtocol.digest`) are never compared.
        verified: whether to compare the rows that were measured with geometric
            verification (true) or without (false).
        rankings: whether to compare only the order of the methods in these
            tables, without the shipped tables. The tables need no condition in
            common; one can contain simulated drives and another real drives.

    Raises:
        InputError: a table cannot be read, has no row to compare, contradicts
            the answers beside it, or the tables have no condition in common.
    """
    if protocol not in (None, *PROTOCOL_NAMES):
        fault = no_such("protocol", protocol, PROTOCOL_NAMES)
        raise InputError(f"--protocol: {fault}")
    notes: list[str] = []
    if metric.endswith(".py"):
        metric = _only_metric(Path(metric)).name
    elif metric not in METRICS:
        notes.append(
            f"{metric}: not known here; more is taken for better (with its"
            " Python file as --metric, its own direction counts)"
        )
    read = []
    for path in paths:
        doing(f"reading {path}")
        read.append(Results.read(path))
    tasks = {
        row.task
        for results in read or shipped_tables()
        for row in results.where(metric=metric).rows
    }
    task = "place" if "place" in tasks else min(tasks, default="")
    selection: dict[str, object] = {
        "metric": metric,
        "task": task,
        "verified": verified,
    }
    if protocol is None and not paths:
        protocol = "random-yaw"
    if protocol is not None:
        selection["protocol"] = protocol
    own: list[MetricTable] = []
    for path, results in zip(paths, read, strict=True):
        doing(f"reading the answers beside {path}")
        table, found = read_metric_table(
            path,
            results,
            selection,
            name=table_name(path, paths),
            is_alone=rankings,
        )
        own.append(table)
        notes += found
    if rankings:
        compared = _compared_rankings(own, metric)
    else:
        shipped = shipped_table(selection)
        if not shipped.rows:
            lacking = _what_shipped_lack(metric, task)
            if not paths:
                raise InputError(lacking)
            notes.append(lacking)
        compared = _compared_values(own, shipped, metric, paths)
    notes += compared.notes
    return replace(compared, task=task, notes=notes)


def _what_shipped_lack(metric: str, task: str) -> str:
    """Returns what to do if no shipped value of a metric fits."""
    if any(one.where(metric=metric).rows for one in shipped_tables()):
        return (
            f"the shipped tables have no {metric} of the task {task or 'place'}"
            " with these options"
        )
    verb = "cns-eval pr DATABASE QUERY --method NAME --output DIR, or "
    if "place" not in metric_named(metric).tasks:
        verb = ""
    return (
        f"the shipped tables have no values of {metric}; measure it"
        f" ({verb}cns-drake study), and give the tables"
    )


def rows_beside_shipped(results: Results, metric: str) -> tuple[list[Row], str]:
    """Returns a study's results and the shipped ones of the same conditions.

    Only place recognition without geometric verification counts. Controls count
    only if all conditions are controls.

    Returns:
        The rows of all methods that have all common conditions, each with its
        label as `method`; and why there are none, else "". A method whose
        shipped results differ from the study's appears twice.
    """
    selection = {"metric": metric, "task": "place", "verified": False}
    own = table_of(_STUDY, results, selection)
    if not own.rows:
        return [], f"{metric} was not measured"
    shipped = shipped_table(selection)
    known = set(shipped.conditions)
    common = [one for one in own.conditions if one in known]
    if not common:
        return [], _why_nothing_is_common(own, shipped)
    common, _ = _without_controls(common)
    tables = [_reduced_to(table, common) for table in (shipped, own)]
    entries, _ = _ranked_entries(tables, common)
    for why in _mismatch_notes(entries, common):
        return [], why
    return [
        replace(table.rows[method, condition], method=name)
        for name, (table, method) in entries.items()
        for condition in common
    ], ""


def _only_metric(path: Path) -> Metric:
    """Returns the metric that a user's file registers."""
    found = load_metrics(path)
    if len(found) > 1:
        names = ", ".join(one.name for one in found)
        raise InputError(f"--metric: {path}: registers several ({names})")
    return found[0]


def _compared_rankings(own: Sequence[MetricTable], metric: str) -> Comparison:
    """Compares the orders of the methods in the user's tables."""
    if len(own) < 2:
        raise InputError("--rankings: two tables are needed")
    tables, notes = [], []
    for table in own:
        changed, left_out = _without_controls(table.conditions)
        tables.append(_reduced_to(table, changed))
        notes += [f"{table.name}: {note}" for note in left_out]
    agreements = [
        _rank_agreement(*pair) for pair in itertools.combinations(tables, 2)
    ]
    ranked = [
        mean._replace(method=f"{mean.method} ({table.name})")
        for table in tables
        for mean in rank_methods(table.rows.values())
    ]
    return Comparison(metric, "", 0, ranked, (), agreements, (), notes)


def _compared_values(
    own: Sequence[MetricTable],
    shipped: MetricTable,
    metric: str,
    paths: Sequence[Path],
) -> Comparison:
    """Compares the values of all tables in the conditions that all have."""
    common, notes = _common_conditions(own, shipped, paths)
    common, left_out = _without_controls(common)
    tables = [_reduced_to(table, common) for table in (shipped, *own)]
    entries, incomplete = _ranked_entries(tables, common)
    notes += [*left_out, *incomplete, *_mismatch_notes(entries, common)]
    rows = [
        replace(table.rows[method, condition], method=name)
        for name, (table, method) in entries.items()
        for condition in common
    ]
    agreements = [
        _rank_agreement(*pair)
        for pair in itertools.combinations(tables, 2)
        if len({*pair[0].methods} & {*pair[1].methods}) > 1
    ]
    return Comparison(
        metric,
        "",
        len(common),
        rank_methods(rows),
        _differences(entries, common) if metric in _OF_ANSWERS else (),
        agreements,
        judge_survival(rows) if metric == RELATIVE else (),
        notes,
    )


def _ranked_entries(
    tables: Sequence[MetricTable], common: Sequence[Condition]
) -> tuple[dict[str, tuple[MetricTable, str]], list[str]]:
    """Returns the methods to rank by their names, and notes on the others.

    A method with the same results in two tables appears only once. If the
    results differ, the name of a table is appended to the name of its method.

    Args:
        tables: the shipped tables, followed by the user's tables.
        common: the conditions that all tables have.
    """
    notes = []
    kept: list[tuple[MetricTable, str]] = []
    # The user's tables come first: they may hold answers to queries.
    for table in (*tables[1:], tables[0]):
        for method in table.methods:
            has = sum((method, condition) in table.rows for condition in common)
            if has < len(common):
                is_once = sum(method in other.methods for other in tables) == 1
                name = method if is_once else f"{method} ({table.name})"
                notes.append(
                    f"{name}: left out, with {has} of {len(common)} conditions"
                )
                continue
            others = [
                (other.name, _deviations(method, other, table, common))
                for other, name in kept
                if name == method
            ]
            same = [
                name
                for name, deviations in others
                if all(deviation <= _ALIKE for deviation in deviations)
            ]
            if same:
                notes.append(
                    f"{method}: the same in {same[0]} and {table.name}; shown"
                    " once"
                )
                continue
            if table is tables[0]:
                notes += [
                    f"{method}: other values in {name} and {table.name} "
                    f"{_extent(deviations)}"
                    for name, deviations in others
                ]
            kept.append((table, method))
    counts = Counter(method for _, method in kept)
    # In the order of the tables, as ties are shown.
    kept.sort(key=lambda entry: tables.index(entry[0]))
    return {
        f"{method} ({table.name})"
        if table is not tables[0] and counts[method] > 1
        else method: (table, method)
        for table, method in kept
    }, notes


def _deviations(
    method: str,
    first: MetricTable,
    second: MetricTable,
    common: Sequence[Condition],
) -> list[float]:
    """Returns how far the values of a method differ, in each condition."""
    return [
        abs(
            first.rows[method, condition].value
            - second.rows[method, condition].value
        )
        for condition in common
    ]


def _extent(deviations: Sequence[float]) -> str:
    """Returns in how many conditions values differ, and by how much."""
    number = sum(deviation > _ALIKE for deviation in deviations)
    extent = (
        f"in {number} of {len(deviations)} conditions, by up to "
        f"{max(deviations):.4f}"
    )
    if max(deviations) <= _ROUNDED:
        extent += (
            "; rounding on another processor, or by other versions of "
            "packages, can change single answers"
        )
    return extent


def _mismatch_notes(
    entries: Mapping[str, tuple[MetricTable, str]],
    common: Sequence[Condition],
) -> Iterator[str]:
    """Yields notes on results of different queries or program versions."""
    rows = {
        name: [table.rows[method, condition] for condition in common]
        for name, (table, method) in entries.items()
    }
    unknown = [
        name
        for name, of_method in rows.items()
        if any(r.n is None for r in of_method)
    ]
    if unknown and len(unknown) < len(rows):
        yield f"{', '.join(unknown)}: of how many queries is not known"
    for of_condition in zip(*rows.values(), strict=True):
        numbers: dict[int, str] = {}
        for name, row in zip(rows, of_condition, strict=True):
            if row.n is not None:
                numbers.setdefault(row.n, name)
        if len(numbers) > 1:
            each = ", ".join(f"{n} ({name})" for n, name in numbers.items())
            yield (
                f"{of_condition[0].database} -> {of_condition[0].query}: not"
                f" the same queries: {each}; their values are of different"
                " difficulty"
            )
            break
    versions = {
        row.version for of_method in rows.values() for row in of_method
    } - {""}
    if len(versions) > 1:
        yield f"measured by versions {', '.join(sorted(versions))}"
    baselines = {
        row.baseline or "the first values"
        for of_method in rows.values()
        for row in of_method
        if metric_named(row.metric).is_compared
    }
    if len(baselines) > 1:
        yield f"not the same baselines: {', or '.join(sorted(baselines))}"


def _differences(
    entries: Mapping[str, tuple[MetricTable, str]],
    common: Sequence[Condition],
) -> list[Compared]:
    """Compares any two methods that have answers in all conditions."""
    asked: dict[str, list[Answers]] = {}
    for name, (table, method) in entries.items():
        keys = [(method, condition) for condition in common]
        if all(key in table.answers for key in keys):
            asked[name] = [table.answers[key] for key in keys]
    for of_condition in zip(*asked.values(), strict=True):
        for pair in itertools.combinations(of_condition, 2):
            _check_same_queries(*pair)
    compared = compared_by_right_answers(
        {
            name: [in_condition.outcomes for in_condition in of_method]
            for name, of_method in asked.items()
        },
        # A number that identifies the query drive in all tables.
        [
            zlib.crc32(f"{in_condition.map} {in_condition.query}".encode())
            for in_condition in next(iter(asked.values()), ())
        ],
    )
    return [Compared(*two, found) for two, found in compared.items()]


def _check_same_queries(first: Answers, second: Answers) -> None:
    """Raises an error unless two methods answered the same queries."""
    frames, others = (a.columns["query_frame"] for a in (first, second))
    two = (
        f"{first.experiment}: {first.database}, {first.query}:"
        f" {first.label} and {second.label}"
    )
    if not np.array_equal(frames, others):
        raise InputError(f"{two} answered different queries")
    with value_errors(f"{two}: column block"):
        common_blocks([first.outcomes, second.outcomes])


def _common_conditions(
    own: Sequence[MetricTable],
    shipped: MetricTable,
    paths: Sequence[Path],
) -> tuple[list[Condition], list[str]]:
    """Returns the conditions that all tables have, and notes for the user.

    If the shipped table has none of the conditions that the tables of the user
    have in common, only the user's tables count.
    """
    if not own:
        return shipped.conditions, []
    common = own[0].conditions
    for table in own[1:]:
        common = [
            condition
            for condition in common
            if condition in set(table.conditions)
        ]
    with_shipped = [
        condition
        for condition in common
        if condition in set(shipped.conditions)
    ]
    if with_shipped:
        others = (*own, shipped)
        return with_shipped, _notes_on_left_out(own, others, with_shipped)
    if common:
        notes = _notes_on_left_out(own, own, common)
        if shipped.rows:
            why = _why_nothing_is_common(own[0], shipped)
            notes.append(
                f"the shipped tables have none of these conditions ({why})"
            )
        return common, notes
    names = ", ".join(map(str, paths))
    why = _why_nothing_is_common(own[0], own[1])
    raise InputError(f"{names}: no condition in common ({why})")


def _notes_on_left_out(
    own: Sequence[MetricTable],
    tables: Sequence[MetricTable],
    common: Iterable[Condition],
) -> list[str]:
    kept = set(common)
    notes: Counter[str] = Counter()
    for table in own:
        left = {c: r for (_, c), r in table.rows.items() if c not in kept}
        for condition, row in left.items():
            other = next(
                lacking
                for lacking in tables
                if lacking is not table
                and condition not in set(lacking.conditions)
            )
            wanted = row.without("method", "protocol")
            alike = [
                candidate
                for candidate in other.rows.values()
                if candidate.without("method", "protocol") == wanted
            ]
            name = "the shipped tables" if other.name == SHIPPED else other.name
            lack = "lack" if other.name == SHIPPED else "lacks"
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
    conditions: list[Condition],
) -> tuple[list[Condition], list[str]]:
    """Returns the conditions with a change, and a note on the others.

    If no condition has a change, the result contains all conditions.
    """
    changed = [
        condition for condition in conditions if (STAGE, LAST) not in condition
    ]
    left = len(conditions) - len(changed)
    if not left or not changed:
        return conditions, []
    return changed, [
        f"left out, as nothing changes in them ({STAGE} {LAST}): {left}"
        " conditions"
    ]


def _why_nothing_is_common(table: MetricTable, other: MetricTable) -> str:
    """Returns as text why two tables have no condition in common."""
    rows = [list(compared.rows.values()) for compared in (table, other)]
    factors = {
        name: None
        for of_table in rows
        for row in of_table
        for name in row.factors
    }
    for column in (*(name for name in KEYS if name != "version"), *factors):
        first, second = (
            sorted({str(row[column]) for row in of_table}) for of_table in rows
        )
        if column != "method" and not {*first} & {*second}:
            return (
                f"{column}: {', '.join(first[:3])} in {table.name}, but"
                f" {', '.join(second[:3])} in {other.name}"
            )
    return "each value is in both, but no row has the same ones in all columns"


def _reduced_to(table: MetricTable, common: Iterable[Condition]) -> MetricTable:
    kept = set(common)
    rows = {key: row for key, row in table.rows.items() if key[1] in kept}
    return replace(table, rows=rows)
