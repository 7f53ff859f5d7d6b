"""Conditions: the combinations of an experiment's factors and cases."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set
from dataclasses import dataclass, field, replace
import itertools
import math
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_type_hints

from pydantic import ConfigDict, create_model

from evaluation.base import InputError, merged, nested, no_such, validated
from evaluation.methods import SETTINGS
from evaluation.recognition import (
    PROTOCOLS,
    ProtocolFieldError,
    RetrievalProtocol,
)
from evaluation.results import CAUSE, FROZEN_REDRAW, LEVEL, NO_CAUSE
from evaluation.study.experiments.factors import (
    SIDES,
    Case,
    Changes,
    FactorValues,
    leaves,
    set_field,
    split_values,
    table_value,
)

if TYPE_CHECKING:
    from evaluation.study.experiments.experiment import Experiment

# Places in the file of an experiment where a list of values is a factor.
_FACTORED = (*SIDES, "protocol")
# Greatest number of conditions x seeds x maps x methods. A study of more would
# take years.
_MOST_MEASUREMENTS = 500_000


@dataclass(frozen=True)
class Condition:
    """One condition of an experiment: a value for each factor.

    Attributes:
        factors: name of each factor -> its value. Each factor is a column of
            the tables.
        changes: fields that the condition sets, under `database`, `query`,
            `both` or `protocol`.
        causes: the causes of change that are combined. Each cause is a list of
            alternatives: the fields for the wanted level of change, followed by
            the fields for each lower level. The first alternative that is
            possible on a map is used.
        baseline: the factors of the condition with which this one is
            compared, which can be this condition itself.
    """

    factors: Changes
    changes: Mapping[str, Changes]
    causes: tuple[tuple[Mapping[str, Changes], ...], ...] = ()
    baseline: Changes = field(default_factory=dict)


class _CaseLevel(NamedTuple):
    """A case at one of its levels; `causes` as in `Condition`."""

    name: str
    level: int
    causes: tuple[tuple[Case, ...], ...]


def conditions(experiment: Experiment) -> list[Condition]:
    """Returns the conditions of an experiment, the baseline first.

    Raises:
        ValueError: a factor has no values or the same value twice, the baseline
            names an unknown factor or value, or there is too much to measure.
    """
    fixed, factors = _fields_and_factors(experiment)
    named = _named_values(experiment, factors)
    centre = {n: named.get(n, values[0]) for n, values in factors.items()}
    compared = _compared_values(experiment, named, centre)
    cases = list(_case_levels(experiment))
    _check_paths_differ(factors, experiment.cases)
    number = (
        _num_cells(experiment.design, factors)
        * len(cases)
        * len(experiment.seeds)
        * len(experiment.maps or [""])
        * len(experiment.method_variants or [""])
    )
    if number > _MOST_MEASUREMENTS:
        raise ValueError(
            f"{number} measurements (conditions x seeds x maps x methods), more"
            f" than {_MOST_MEASUREMENTS}"
        )
    cells = _cells(experiment.design, factors, centre)
    found = []
    for cell, case in itertools.product(cells, cases):
        changes: dict[str, Any] = fixed
        for path, value in cell.items():
            changes = merged(changes, nested(path, value))
        of_case = (
            {CAUSE: case.name, LEVEL: case.level} if experiment.cases else {}
        )
        factors_now = {n: table_value(one) for n, one in cell.items()}
        found.append(
            Condition(
                of_case | factors_now,
                changes,
                case.causes,
                of_case | factors_now | compared,
            )
        )
    return found


def baseline_values(experiment: Experiment) -> dict[str, Any]:
    """Returns the values that an experiment names for its baselines.

    Returns:
        Name of a factor -> its value in the baseline, as in tables.
    """
    _, factors = _fields_and_factors(experiment)
    named = _named_values(experiment, factors)
    return {name: table_value(one) for name, one in named.items()}


def _fields_and_factors(
    experiment: Experiment,
) -> tuple[dict[str, Any], dict[str, list[Any]]]:
    """Returns the fixed fields, and each factor's values by factor path."""
    fixed: dict[str, Any] = {}
    factors: dict[str, list[Any]] = {}
    for side in _FACTORED:
        single, varied = split_values(getattr(experiment, side), (side,))
        for path, value in single.items():
            if path != FROZEN_REDRAW:
                set_field(fixed, path, value)
        factors |= {n: some for n, some in varied.items() if n != FROZEN_REDRAW}
    return fixed, factors


def _named_values(
    experiment: Experiment, factors: Mapping[str, list[Any]]
) -> dict[str, Any]:
    """Returns the values that the field `baseline` names, by factor."""
    known: dict[str, Iterable[Any]] = {}
    if experiment.cases:
        most = max(levels_by_case(experiment).values())
        known = {CAUSE: (NO_CAUSE, *experiment.cases), LEVEL: range(most + 1)}
    known |= factors
    settings: dict[str, list[Any]] = {}
    for one in experiment.method_variants:
        for path, value in one.columns.items():
            settings.setdefault(path, []).append(value)
    known |= settings
    named = dict(leaves(experiment.baseline, ()))
    for path, value in named.items():
        if path not in known:
            raise ValueError(f"baseline.{path}: this is no factor")
        if path in settings:
            value = named[path] = table_value(value)
        if value not in known[path]:
            raise ValueError(f"baseline.{path}: {value!r} is no value of it")
    return named


def _compared_values(
    experiment: Experiment, named: Changes, centre: Changes
) -> dict[str, Any]:
    """Returns the factors that a baseline does not share with its condition.

    By default these are all factors but those of the protocol: each protocol
    has one baseline. If the field `baseline` names values, these are the
    factors that it names. The centre of one factor at a time is the baseline
    in any case. A setting of a method is a factor of the method, not of the
    condition.

    Args:
        experiment: the experiment.
        named: the values that the field `baseline` names.
        centre: the values of all factors of fields in the first condition.

    Returns:
        Name of a factor -> its value in the baseline, as in tables.
    """
    found = {n: v for n, v in named.items() if not n.startswith(SETTINGS)}
    if not named or experiment.design != "product":
        of_protocol = {n for n in centre if n.startswith("protocol.")}
        shared = of_protocol - {*named}
        found = {n: v for n, v in centre.items() if n not in shared} | found
        if experiment.cases:
            found = {CAUSE: NO_CAUSE, **found}
    if found.get(CAUSE) == NO_CAUSE:
        found[LEVEL] = 0
    return {n: table_value(one) for n, one in found.items()}


def _check_paths_differ(
    factors: Mapping[str, list[Any]], cases: Mapping[str, Any]
) -> None:
    """Checks that no field is changed by two factors, or by factor and case."""
    taken = _changed_paths("", factors.items(), set())
    for name, case in cases.items():
        if isinstance(case, dict):
            _changed_paths(f"cases.{name}.", leaves(case, ()), taken)


def _changed_paths(
    place: str, fields: Iterable[tuple[str, Any]], taken: Set[str]
) -> set[str]:
    """Returns the taken paths, together with the paths that fields change.

    Args:
        place: the beginning of the fields' paths, for the error message.
        fields: path and value or values of each field.
        taken: paths that these fields must not change.

    Raises:
        ValueError: a path is taken.
    """
    found = set(taken)
    for path, values in fields:
        some = values if isinstance(values, list) else [values]
        # A mapping as a value changes several fields.
        paths = {leaf for one in some for leaf, _ in leaves({path: one}, ())}
        if paths & found:
            path = min(paths & found)
            raise ValueError(f"{place}{path}: another factor changes it, too")
        found |= paths
    return found


def _num_cells(design: str, factors: Mapping[str, list[Any]]) -> int:
    """Returns the length of `_cells`, which can be too long to be made."""
    if design == "product":
        return math.prod(map(len, factors.values()))
    return 1 + sum(len(values) - 1 for values in factors.values())


def _cells(
    design: str,
    factors: Mapping[str, list[Any]],
    baseline: Mapping[str, Any],
) -> list[dict[str, Any]]:
    """Returns the values of the factors in each condition without cases.

    The baseline is the first.
    """
    if design == "product":
        cells = [
            dict(zip(factors, some, strict=True))
            for some in itertools.product(*factors.values())
        ]
        return sorted(cells, key=lambda cell: cell != baseline)
    return [
        dict(baseline),
        *(
            {**baseline, path: one}
            for path, values in factors.items()
            for one in values
            if one != baseline[path]
        ),
    ]


def _case_levels(experiment: Experiment) -> Iterator[_CaseLevel]:
    """Yields all cases at all levels to measure; the case `none` is first."""
    yield _CaseLevel(NO_CAUSE, 0, ())
    if experiment.levels and not experiment.cases:
        raise ValueError("levels: there are no cases")
    numbers = levels_by_case(experiment)
    most = max(numbers.values(), default=0)
    if experiment.levels and max(experiment.levels) > most:
        raise ValueError(
            f"levels: no case has level {max(experiment.levels)}; the greatest"
            f" is {most}"
        )
    for name, most in numbers.items():
        members = _member_fields(experiment, name)
        lengths = [_levels_of_case(one, f"cases.{name}") for one in members]
        wanted = experiment.levels or range(1, most + 1)
        for level in sorted({min(level, most) for level in wanted}):
            # Only a combined case can take a lower level of a member.
            least = level if len(members) == 1 else 1
            yield _CaseLevel(
                name,
                level,
                tuple(
                    tuple(
                        _at_level(one, k)
                        for k in range(level, least - 1, -1)
                        if k <= length
                    )
                    for one, length in zip(members, lengths, strict=True)
                ),
            )


def levels_by_case(experiment: Experiment) -> dict[str, int]:
    """Returns the number of levels of each case, by the case's name.

    Raises:
        ValueError: a case has the name of the condition without a change, or
            combines something that is not a case.
    """
    found = {}
    for name in experiment.cases:
        if name == NO_CAUSE:
            raise ValueError(f"cases.{name}: the name of what has no cause")
        members = _member_fields(experiment, name)
        found[name] = max(
            _levels_of_case(one, f"cases.{name}") for one in members
        )
    return found


def _member_fields(experiment: Experiment, name: str) -> list[Case]:
    """Returns the fields of a case, or of each case that it combines."""
    case = experiment.cases[name]
    found = []
    for one in case if isinstance(case, tuple) else [name]:
        member = experiment.cases.get(one)
        if not isinstance(member, dict):
            raise ValueError(f"cases.{name}: {one} is no case with fields")
        found.append(member)
    return found


def _levels_of_case(case: Case, place: str) -> int:
    values = (value for _, value in leaves(case, (place,)))
    lists = (some for some in values if isinstance(some, FactorValues))
    return max(map(len, lists), default=1)


def _at_level(case: Case, level: int) -> Case:
    """Returns the fields of a case at a level.

    A field with fewer values than `level` has its last value.
    """
    fields: Any = {}
    for path, value in leaves(case, ()):
        if isinstance(value, FactorValues):
            value = value[min(level, len(value)) - 1]
        set_field(fields, path, value)
    return fields


# The fields of a protocol that a study can vary. Both settings of geometric
# verification are measured in any case; matches are by distance, and drives
# differ.
_ProtocolFields = create_model(  # type: ignore[call-overload]  # Fields are computed.
    "_ProtocolFields",
    __config__=ConfigDict(extra="forbid", strict=True, allow_inf_nan=False),
    **{
        name: (kind, None)
        for name, kind in get_type_hints(
            RetrievalProtocol, localns={"PlaceScan": Literal["middle", "first"]}
        ).items()
        if name not in ("verified", "overlap", "exclude_recent")
    },
)


def protocol_from_fields(
    fields: Changes, source: object, place: str = "protocol"
) -> RetrievalProtocol:
    """Returns the protocol that some fields of an experiment describe.

    Args:
        fields: field -> value. The field `base` names a protocol; by default
            `random-yaw`. Fields that are not given have the values of this
            protocol.
        source: file of the experiment, for error messages.
        place: name of the section with these fields, for error messages.

    Raises:
        InputError: a field is unknown or out of range.
    """
    values = dict(fields)
    base = values.pop("base", "random-yaw")
    if not isinstance(base, str) or base not in PROTOCOLS:
        fault = no_such("protocol", base, PROTOCOLS)
        raise InputError(f"{source}: {place}.base: {fault}")
    validated(_ProtocolFields, values, f"{source}: {place}")
    try:
        return replace(PROTOCOLS[base], **values)
    except ProtocolFieldError as error:
        where = f"{source}: {place}.{error.field}"
        raise InputError(f"{where}: {error.fault}") from None


def condition_protocol(
    condition: Condition, source: object
) -> RetrievalProtocol:
    """Returns the protocol of a condition, as by `protocol_from_fields`."""
    return protocol_from_fields(condition.changes.get("protocol", {}), source)
