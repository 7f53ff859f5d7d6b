"""Experiments: what differs between two drives, and what is measured.

An experiment is a YAML file. The file names maps, fields of the database drive
and of the query drive, and the tasks to measure. A field with a list of values
is a factor, and each combination of factors and cases is a condition.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set
import contextlib
from dataclasses import dataclass, field, replace
from functools import cached_property
import itertools
import math
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Literal,
    NamedTuple,
    get_type_hints,
)

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    create_model,
    model_validator,
)
import yaml

from evaluation.base import (
    InputError,
    Name,
    Section,
    merged,
    nested,
    no_such,
    validated,
)
from evaluation.methods import SETTINGS
from evaluation.recognition import (
    PROTOCOLS,
    ProtocolFieldError,
    RetrievalProtocol,
)
from evaluation.results import CAUSE, FROZEN_REDRAW, LEVEL, NO_CAUSE
from evaluation.study.experiments.factors import (
    FACTORED,
    SIDES,
    Case,
    Changes,
    FactorValues,
    check_once,
    check_words,
    expand_spread,
    leaves,
    set_field,
    split_values,
    table_value,
)
from evaluation.study.experiments.method_variants import (
    MethodVariant,
    method_variants,
)

if TYPE_CHECKING:
    from typing_extensions import Self

# Greatest number of conditions x seeds x maps x methods. A study of more would
# take years.
_MOST_MEASUREMENTS = 500_000


def _listed(value: Any) -> Any:
    """Returns a list of distinct values, from one value or from a spread."""
    value = expand_spread(value, whole=True)
    value = [value] if isinstance(value, str | int | dict) else value
    if isinstance(value, list):
        # A map to make has a name.
        check_once(
            one.get("name", one) if isinstance(one, dict) else one
            for one in value
        )
    return value


def _settings_by_name(value: Any) -> Any:
    """Returns a list of names as a mapping without settings."""
    if isinstance(value, str):
        value = [value]
    if not isinstance(value, list):
        return value
    check_once(value)
    return {str(name): {} for name in value}


def _protocol_fields(value: Any) -> Any:
    """Returns names of protocols as the field `base`."""
    return {"base": value} if isinstance(value, str | list) else value


def _case(value: Any) -> Case | tuple[str, ...]:
    """Returns a case's fields for each drive, or the names of cases to join."""
    if isinstance(value, list | tuple):
        if not value or not all(isinstance(one, str) for one in value):
            raise ValueError("a list of a case holds names of other cases")
        check_once(value)
        return tuple(value)
    if not (isinstance(value, dict) and value):
        raise ValueError("neither fields of a side nor names of other cases")
    for side, fields in value.items():
        if side not in FACTORED:
            raise ValueError(
                f"{side}: no section of a case (there are:"
                f" {', '.join(FACTORED)})"
            )
        if not (isinstance(fields, dict) and fields):
            raise ValueError(f"{side}: no fields")
    return value


_Settings = Annotated[
    dict[str, dict[str, Any]], BeforeValidator(_settings_by_name)
]
_Protocol = Annotated[dict[str, Any], BeforeValidator(_protocol_fields)]


class MadeMap(Section):
    """A map that an experiment makes: an aged city or an imported city.

    Attributes:
        name: name of the new map.
        age: name of the map to age; give this or `import`.
        years: number of years by which to age the map.
        import_file: file of a real city to import, in the folder `files` of the
            experiment.
        sha256: SHA-256 digest of the imported file, so that everyone imports
            the same file.
        grow: share of the imported buildings, sampled at random, that are
            missing or lower in the first stage.
        plain: whether windows, roofs and kerbs that the file lacks are left
            out, as by `--plain` of `cns-drake import`.
        seed: seed of all random numbers.
    """

    name: Name
    age: str | None = None
    years: int | None = Field(default=None, ge=1, le=200)
    import_file: str | None = Field(default=None, alias="import")
    sha256: str | None = None
    grow: float | None = Field(default=None, ge=0.0, le=1.0)
    plain: bool = False
    seed: int = Field(ge=0)

    @model_validator(mode="after")
    def _check_source(self) -> MadeMap:
        if (self.age is None) == (self.import_file is None):
            raise ValueError("give either age (a map) or import (a file)")
        if (self.age is None) != (self.years is None):
            raise ValueError("years: they belong to age")
        for name in ("sha256", "grow", "plain"):
            if self.age is not None and name in self.model_fields_set:
                raise ValueError(f"{name}: it belongs to import; leave it out")
        return self


def _name_or_made_map(value: Any) -> str | MadeMap:
    """Returns the name of a map, or how to make one."""
    if isinstance(value, str | MadeMap):
        return value
    if not isinstance(value, Mapping):
        raise ValueError("neither a name nor how to make a map")
    try:
        return validated(MadeMap, value, "to be made")
    except InputError as error:
        raise ValueError(str(error)) from None


class Experiment(Section):
    """A question about two drives: what varies, and what is measured.

    Attributes:
        name: name of the experiment in all tables.
        about: the question in words.
        maps: names of shipped maps, folders of maps, folders of recordings, or
            maps to make.
        files: folder with the files that the field `import` of a map names.
        drives: which drives of a map are compared: the last drive with one
            along the same route (`same-route`), with each earlier drive
            (`stages`), in both directions if there are two (`both-ways`), or
            with the first (`first-and-last`).
        both: scenario fields of both drives. A list of values makes a field a
            factor, which varies.
        database: scenario fields of the drive that makes the database, in the
            same way. `sessions` is a list of several such drives, of which
            `keep` selects places and `maintain` updates the maps.
        query: scenario fields of the drive that makes the queries, in the same
            way.
        cases: kinds of change by name. Each sets fields of one or both drives
            or of the protocol, or is a list of other cases to combine; a list
            of values sets its levels, the weakest first. Each is compared with
            the case `none`, which changes nothing.
        levels: which levels of each case to measure, as numbers from 1; by
            default all. A case with fewer levels is measured at its last one
            instead.
        design: how factors are combined: each value of a factor with each value
            of all others (`product`), or while all others have the baseline's
            values (`one-at-a-time`).
        tasks: tasks to measure, as a list of names; to change settings, a
            mapping from each name to its settings.
        methods: methods to run, as a list of names or Python files; to change
            settings, a mapping from each name to its settings. A setting with a
            list of values is a factor.
        metrics: metrics that the page shows, the most important first: names,
            or Python files with metrics of your own. By default the main
            metrics of each task.
        seeds: seeds of all random numbers. Each condition is measured with each
            seed.
        protocol: `random-yaw`, `paper` or `recorded`; a list of these names,
            each with a baseline of its own; or fields of a protocol, of which
            `base` provides the rest.
        baseline: values of some factors, such as `{both.stage: last}`, or of a
            method's setting: each condition is compared with the one that has
            these values, and its own values of all other factors.
        frozen: table of the shipped worlds, such as `levels.csv`, with a
            fingerprint of each level's drives. If a drive no longer has its
            fingerprint, the study stops with an error.
        charts: charts to show on the page of the experiment.
        quick: fields to replace if `--quick` is given: `tasks`, `methods` and
            lists as a whole, of other mappings only the fields that you name.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][\w.-]*$")]
    about: str = ""
    maps: Annotated[
        tuple[
            Annotated[
                Any,
                PlainValidator(
                    _name_or_made_map, json_schema_input_type=str | MadeMap
                ),
            ],
            ...,
        ]
        | None,
        BeforeValidator(_listed),
    ] = Field(default=None, min_length=1)
    files: str | None = None
    drives: Literal["same-route", "stages", "both-ways", "first-and-last"] = (
        "same-route"
    )
    both: dict[str, Any] = Field(default_factory=dict)
    database: dict[str, Any] = Field(default_factory=dict)
    query: dict[str, Any] = Field(default_factory=dict)
    cases: dict[
        Name, Annotated[Any, PlainValidator(_case, json_schema_input_type=dict)]
    ] = Field(default_factory=dict)
    levels: Annotated[
        tuple[Annotated[int, Field(ge=1, le=100, strict=True)], ...] | None,
        BeforeValidator(_listed),
    ] = Field(default=None, min_length=1)
    design: Literal["product", "one-at-a-time"] = "product"
    tasks: _Settings = Field(default={"place": {}}, min_length=1)
    methods: _Settings | None = Field(default=None, min_length=1)
    metrics: Annotated[tuple[str, ...], BeforeValidator(_listed)] = Field(
        default=(), min_length=1
    )
    seeds: Annotated[
        tuple[Annotated[int, Field(ge=0, lt=2**31, strict=True)], ...],
        BeforeValidator(_listed),
    ] = Field(default=(1,), min_length=1)
    protocol: _Protocol = Field(default_factory=dict)
    baseline: dict[str, Any] = Field(default_factory=dict)
    frozen: str | None = None
    charts: tuple[dict[str, Any], ...] = ()
    quick: dict[str, Any] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check_words(self) -> Experiment:
        for side in SIDES:
            check_words(getattr(self, side), side)
            for name, case in self.cases.items():
                if isinstance(case, dict):
                    check_words(case.get(side, {}), f"cases.{name}.{side}")
        return self

    @property
    def frozen_redraws(self) -> list[int]:
        """Numbers of the frozen redraws on which the experiment runs.

        A redraw of a map has other buildings along the same streets. The
        numbers of the frozen redraws come from the field
        `both.city.redraw.frozen`; without this field, the list is empty.
        """
        city = self.both.get("city")
        redraw = city.get("redraw") if isinstance(city, Mapping) else None
        found: Any = []
        if isinstance(redraw, Mapping):
            found = expand_spread(redraw.get("frozen", []))
        return found if isinstance(found, list) else [found]

    @cached_property
    def conditions(self) -> list[Condition]:
        """The conditions: the combinations of factors and cases.

        The baseline is the first.

        Raises:
            ValueError: a factor has no values or the same value twice, the
                baseline names an unknown factor or value, or there are too many
                conditions.
        """
        return conditions(self)

    @property
    def factor_names(self) -> list[str]:
        """The names of the factors, as in the columns of the tables.

        A setting of a method in a Python file is named by the stem of the file,
        as the file has not run yet.
        """
        names = dict.fromkeys(
            name for one in self.conditions for name in one.factors
        )
        if self.frozen_redraws:
            names[FROZEN_REDRAW] = None
        for one in self.method_variants:
            place, name = f"{SETTINGS}{one.name}.", Path(one.name)
            stem = name.stem if name.suffix == ".py" else one.name
            for column in one.columns:
                setting = column.removeprefix(place)
                names[f"{SETTINGS}{stem}.{setting}"] = None
        return list(names)

    @cached_property
    def method_variants(self) -> list[MethodVariant]:
        """The methods that the experiment names, with their settings.

        Raises:
            ValueError: a setting has no values, or the same value twice.
        """
        return method_variants(self.methods or {})

    def replaced(self, **fields: Any) -> Self:
        copy = super().replaced(**fields)
        # They follow from the fields.
        for name in ("conditions", "method_variants"):
            copy.__dict__.pop(name, None)
        return copy

    @property
    def text(self) -> str:
        """The experiment as YAML, without fields that have their defaults."""
        values = self.model_dump(
            mode="json", by_alias=True, exclude_defaults=True
        )
        return yaml.safe_dump(
            values, sort_keys=False, allow_unicode=True, width=79
        )


def named_programs(fields: Any) -> list[str]:
    """Returns the Python files that are named in fields of an experiment.

    A study with these fields runs the files.

    Args:
        fields: a value of any fields, such as `tasks` or `methods`, nested to
            any depth.
    """
    if isinstance(fields, str):
        return [fields] if fields.lower().endswith(".py") else []
    if isinstance(fields, Mapping):
        fields = [*fields, *fields.values()]
    if not isinstance(fields, list | tuple):
        return []
    return [file for one in fields for file in named_programs(one)]


def in_long_form(values: Mapping[str, Any]) -> dict[str, Any]:
    """Returns fields of an experiment, with long forms in place of short forms.

    A field that cannot be used is left unchanged, so that `Experiment` reports
    it.

    Args:
        values: fields of an experiment as its file contains them.
    """
    found = dict(values)
    for name, long_form in (
        ("tasks", _settings_by_name),
        ("methods", _settings_by_name),
        ("protocol", _protocol_fields),
    ):
        if name in found:
            with contextlib.suppress(ValueError):
                found[name] = long_form(found[name])
    return found


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
    for side in FACTORED:
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
