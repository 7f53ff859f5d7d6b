"""Experiments: what differs between two drives, and what is measured.

An experiment is a YAML file. The file names maps, fields of the database drive
and of the query drive, and the tasks to measure. A field with a list of values
is a factor.
"""

from __future__ import annotations

from collections.abc import Mapping
import contextlib
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, PlainValidator, model_validator
import yaml

from evaluation.base import InputError, Name, Section, validated
from evaluation.methods import SETTINGS
from evaluation.results import FROZEN_REDRAW
from evaluation.study.experiments.conditions import Condition, conditions
from evaluation.study.experiments.factors import (
    SIDES,
    Case,
    check_once,
    expand_spread,
)
from evaluation.study.experiments.method_variants import (
    MethodVariant,
    method_variants,
)

if TYPE_CHECKING:
    from typing_extensions import Self


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
        if side not in SIDES:
            raise ValueError(f"{side}: no side (there are: {', '.join(SIDES)})")
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
        age: name of the map to age. Give either a map to age or a file to
            import.
        years: number of years by which to age the map.
        import_file: file of a real city to import, in the folder `files` of the
            experiment.
        sha256: SHA-256 digest of the imported file, so that everyone imports
            the same file.
        grow: share of the imported buildings, sampled at random, that change
            between the first stage and today: in the first stage they are
            missing, or lower than today.
        plain: whether windows, roofs and kerbs that the file lacks are left
            out, as by the option `--plain` of `cns-drake import`.
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
        maps: maps to use: names of shipped maps, folders of maps, folders of
            recordings, or maps to make. By default the shipped cities.
        files: folder with the files that the field `import` of a map names.
        drives: which drives of a map are compared: the last drive with one
            along the same route (`same-route`, the default), with each earlier
            drive (`stages`), in both directions if there are two (`both-ways`),
            or with the first (`first-and-last`).
        both: scenario fields of both drives. A list of values makes the field a
            factor, which varies.
        database: scenario fields of the drive that makes the database. A list
            of values makes the field a factor. `sessions` is a list of several
            such drives, of which `keep` selects places and `maintain` updates
            the maps.
        query: scenario fields of the drive that makes the queries. A list of
            values makes the field a factor.
        cases: kinds of change by name. Each sets fields of one or both drives,
            or is a list of other cases to combine; a list of values sets its
            levels, the weakest first. Each is compared with the case `none`,
            which changes nothing.
        levels: which levels of each case to measure, as numbers from 1; by
            default all. If a number in this list exceeds the number of a case's
            levels, the last level of the case is measured instead.
        design: how factors are combined. `product`: each value of a factor with
            each value of all other factors. `one-at-a-time`: each value of a
            factor, while all other factors have the baseline's values.
        tasks: tasks to measure, as a list of names; to change settings, a
            mapping from each name to its settings.
        methods: methods to run, as a list of names or Python files; to change
            settings, a mapping from each name to its settings. A setting with a
            list of values is a factor. By default the standard methods.
        metrics: metrics that the page shows, the most important first: names,
            or Python files with metrics of your own. By default the main
            metrics of each task. `results.csv` contains all metrics.
        seeds: seeds of all random numbers. Each condition is measured with each
            seed.
        protocol: `random-yaw`, `paper` or `recorded`; a list of these names,
            each with a baseline of its own; or fields of a protocol, of which
            `base` provides the rest.
        baseline: values of some factors, such as `{both.stage: last}`, or of a
            method's setting: each condition is compared with the one that has
            these values, and its own values of all other factors. By default,
            it is the one with the first value of each factor, and without a
            cause of change.
        frozen: table of the shipped worlds, such as `levels.csv`, with a
            fingerprint of each level's drives. The table protects a benchmark
            from changes: if a drive no longer has its fingerprint, the study
            stops with an error.
        charts: charts to show on the page of the experiment.
        quick: fields to replace if `--quick` is given. `tasks`, `methods` and
            lists are replaced as a whole; in other mappings, only the fields
            that you name are replaced.
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

    @property
    def frozen_redraws(self) -> list[int]:
        """Numbers of the frozen redraws on which the experiment runs.

        A redraw of a map has other buildings along the same streets. The
        numbers of the frozen redraws come from the field `both.redraw.frozen`;
        without this field, the list is empty.
        """
        redraw = self.both.get("redraw")
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
