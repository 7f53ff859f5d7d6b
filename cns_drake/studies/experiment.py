"""Experiments: what differs between two drives, and what is measured.

An experiment is a YAML file. The file names maps, fields of the database drive
and of the query drive, and the tasks to measure. A field with a list of values
is a factor; the conditions of the experiment are the product of all factors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
import contextlib
from dataclasses import dataclass, replace
import itertools
import json
import math
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, get_type_hints

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    create_model,
    model_validator,
)

from cns_drake.base.errors import (
    InputError,
    did_you_mean,
    errors_at,
    validated,
    value_errors,
)
from cns_drake.base.repetitions import repeated
from cns_drake.base.yaml_files import parse_yaml, read_yaml
from cns_drake.scenarios.scenario import Name
from cns_drake.sensors.sensor_config import Section
from cns_drake.studies.spread_values import expand_spread, is_spread
from evaluation.recognition.protocol import PROTOCOLS, RetrievalProtocol
from evaluation.results.table import FROZEN_REDRAW

_FOLDER = Path(__file__).with_name("experiments")
SIDES = ("both", "database", "query")
# Places in the file of an experiment where a list of values is a factor.
_FACTORED = (*SIDES, "protocol")
# Fields whose value may be a list -> what is in it; other lists are factors.
_LISTS: Mapping[str, tuple[type, ...]] = {
    "viewpoint": (int, float),
    "without": (str,),
    "route": (dict,),
    "xyz": (int, float),
    "rpy_deg": (int, float),
}
# Factor of experiments with cases: the name of the case.
CAUSE = "cause"
# Factor of experiments with cases: the level of the case.
LEVEL = "level"
NO_CAUSE = "none"
# Field of the database with its drives, each with fields of its own.
SESSIONS = "sessions"
# Field of the database with drives that are sampled at random.
FLEET = "fleet"
_MOST_CONDITIONS = 20_000

Changes = Mapping[str, Any]
Case = dict[str, dict[str, Any]]


def _in_a_tuple(value: Any) -> Any:
    value = expand_spread(value, whole=True)
    value = [value] if isinstance(value, str | int | dict) else value
    if isinstance(value, list):
        # A map to make has a name.
        _check_once(
            [
                one.get("name", one) if isinstance(one, dict) else one
                for one in value
            ]
        )
    return value


def _check_once(values: Any) -> None:
    for one in repeated(values) if isinstance(values, list) else ():
        raise ValueError(f"{one!r} is there twice")


def _by_name(value: Any) -> Any:
    """Returns a list of names as a mapping without settings."""
    if isinstance(value, str):
        value = [value]
    if not isinstance(value, list):
        return value
    _check_once(value)
    return {str(name): {} for name in value}


def _base(value: Any) -> Any:
    return {"base": value} if isinstance(value, str) else value


def _case(value: Any) -> Case | tuple[str, ...]:
    """Returns a case's fields for each drive, or the names of cases to join."""
    if isinstance(value, list | tuple):
        if not value or not all(isinstance(one, str) for one in value):
            raise ValueError("a list of a case holds names of other cases")
        _check_once(list(value))
        return tuple(value)
    if not (isinstance(value, dict) and value):
        raise ValueError("neither fields of a side nor names of other cases")
    for side, fields in value.items():
        if side not in SIDES:
            raise ValueError(f"{side}: no side (there are: {', '.join(SIDES)})")
        if not (isinstance(fields, dict) and fields):
            raise ValueError(f"{side}: no fields")
    return value


_Settings = Annotated[dict[str, dict[str, Any]], BeforeValidator(_by_name)]
# Fields of an experiment that may be written shorter -> their long form.
_LONG_FORMS = {"tasks": _by_name, "methods": _by_name, "protocol": _base}


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
        plain: whether the city has only the windows, roofs and kerbs that the
            file contains. By default, missing ones are sampled at random, as by
            `cns-drake import`.
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
        if self.grow is not None and str(self.import_file).endswith(".xodr"):
            raise ValueError(
                "grow: a road network (.xodr) has two stages anyway; leave it"
                " out"
            )
        return self


def _map(value: Any) -> str | MadeMap:
    """Returns the name of a map, or how to make one."""
    if isinstance(value, str | MadeMap):
        return value
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
            recordings, or maps to make. By default the shipped maps.
        files: folder with the files of real cities that `maps` import.
        drives: which drives of a map are compared. `same-route`: the last drive
            is the query, and the database is recorded along the same route.
            `stages`: the last drive is the query for each earlier drive.
            `both-ways`: as `stages`, but if a map has two drives, each is also
            the query for the other. `first-and-last`: the last drive, through
            the last stage, is the query for the first drive.
        both: scenario fields of both drives. A list of values makes the field a
            factor, which varies.
        database: scenario fields of the drive that makes the database. A list
            of values makes the field a factor. The field `sessions` is a list
            of several database drives, each with fields of its own. With
            `sessions`, the field `keep` limits how many places enter the
            database, and `maintain` names what updates the maps of these
            drives.
        query: scenario fields of the drive that makes the queries. A list of
            values makes the field a factor.
        cases: kinds of change by name. Each case sets fields of one or both
            drives, or is a list of other cases to combine. A list of values
            sets the levels of a case, the weakest first. Each case is measured
            by itself and compared with the case `none`, which changes nothing.
        levels: which levels of each case to measure, as numbers from 1; by
            default all. A case that lacks a level in this list is measured at
            its own last level instead.
        design: how factors are combined. `product`: each value of a factor with
            each value of all other factors. `one-at-a-time`: each value of a
            factor, while all other factors have the baseline's values.
        tasks: tasks to measure: a list of names, or settings by the name of the
            task.
        methods: methods to run: a list of names or Python files, or settings by
            the name of the method. A list of values makes a setting a factor.
            By default all shipped methods.
        seeds: seeds of all random numbers. Each condition is measured with each
            seed.
        protocol: protocol of place recognition: `fair`, `paper` or `recorded`;
            or fields of a protocol of your own. The field `base` then names the
            protocol from which all other fields come.
        baseline: values of the factors in the condition with which all other
            conditions are compared. By default the first value of each factor.
        frozen: table with a fingerprint of each level's drives, which protects
            a benchmark from changes: if a drive no longer has its fingerprint,
            the study stops with an error.
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
                Any, PlainValidator(_map, json_schema_input_type=str | MadeMap)
            ],
            ...,
        ]
        | None,
        BeforeValidator(_in_a_tuple),
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
        BeforeValidator(_in_a_tuple),
    ] = Field(default=None, min_length=1)
    design: Literal["product", "one-at-a-time"] = "product"
    tasks: _Settings = Field(default={"place": {}}, min_length=1)
    methods: _Settings | None = Field(default=None, min_length=1)
    seeds: Annotated[
        tuple[Annotated[int, Field(ge=0, lt=2**31, strict=True)], ...],
        BeforeValidator(_in_a_tuple),
    ] = Field(default=(1,), min_length=1)
    protocol: Annotated[dict[str, Any], BeforeValidator(_base)] = Field(
        default_factory=dict
    )
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

    @property
    def text(self) -> str:
        """The experiment as YAML, without fields that have their defaults."""
        import yaml

        values = self.model_dump(
            mode="json", by_alias=True, exclude_defaults=True
        )
        return yaml.safe_dump(
            values, sort_keys=False, allow_unicode=True, width=79
        )


def named_programs(fields: Any) -> list[str]:
    """Returns the Python files that fields of an experiment name.

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


def shipped_experiments() -> dict[str, Path]:
    """Returns name -> file of the experiments in this package."""
    return {path.stem: path for path in sorted(_FOLDER.glob("*.yaml"))}


def load_experiment(
    name_or_file: str | Path,
    overrides: Iterable[str | tuple[str, Any]] = (),
    *,
    quick: bool = False,
    on_note: Callable[[str], None] = lambda text: None,
) -> Experiment:
    """Reads an experiment.

    Args:
        name_or_file: a shipped experiment by name, or a file.
        overrides: fields to change. Each is a text `FIELD=VALUE`, or a pair of
            a top-level field and its value. In a text, VALUE is YAML and dots
            separate nested fields, as in `database.years=[0, 5]`.
        quick: whether the fields in the section `quick` of the experiment
            replace its other fields.
        on_note: is called with a note on each word of an earlier version.

    Raises:
        InputError: there is no such experiment, or a field is unknown or not
            usable.
    """
    shipped = shipped_experiments()
    path = shipped.get(str(name_or_file), Path(name_or_file))
    if not path.is_file():
        raise InputError(
            f"{name_or_file}: neither an experiment of this package "
            f"({', '.join(shipped)}) nor a file"
            f"{did_you_mean(name_or_file, shipped)}"
        )
    values = read_yaml(path)
    if not isinstance(values, dict):
        raise InputError(f"{path}: not a mapping of an experiment's fields")
    values.setdefault("name", path.stem)
    for name, long_form in _LONG_FORMS.items():
        # Their validation names the field that cannot be used.
        with contextlib.suppress(ValueError):
            values |= {name: long_form(values[name])} if name in values else {}
    if quick:
        if not isinstance(values.get("quick"), dict):
            raise InputError(
                f"{path}: quick: missing, or no mapping; --quick needs this"
                " section, with the fields to replace"
            )
        values = _chosen_anew(values, values["quick"])
    for one in overrides:
        if isinstance(one, str):
            is_nested = "." in one.partition("=")[0]
            change = merged if is_nested else _chosen_anew
            fields: Changes = parse_override(one)
            (first,) = fields
            if is_nested and first not in Experiment.model_fields:
                fields, values = _of_method(one, fields, values)
            values = change(values, fields)
        else:
            values = values | dict([one])
    values = _in_words_of_now(values, f"{path}: ", on_note)
    experiment = validated(Experiment, values, path)
    with value_errors(path):
        conditions(experiment)
        method_variants(experiment.methods or {})
    if not quick and experiment.quick:
        with errors_at(f"{path}: quick", f"{path}: "):
            load_experiment(name_or_file, overrides, quick=True)
    return experiment


def _in_words_of_now(
    values: dict[str, Any], place: str, on_note: Callable[[str], None]
) -> dict[str, Any]:
    """Returns fields in which words of earlier versions are replaced.

    The field `fresh` of both sides is now `redraw.frozen`.
    """
    quick = values.get("quick")
    if isinstance(quick, dict):
        inner = _in_words_of_now(quick, f"{place}quick.", on_note)
        values = {**values, "quick": inner}
    both = values.get("both")
    if not (isinstance(both, dict) and "fresh" in both):
        return values
    on_note(f"{place}both.fresh: this field is now {FROZEN_REDRAW}")
    number = {"redraw": {"frozen": both["fresh"]}}
    left = {name: one for name, one in both.items() if name != "fresh"}
    return {**values, "both": merged(left, number)}


def _of_method(
    text: str, fields: Changes, values: dict[str, Any]
) -> tuple[Changes, dict[str, Any]]:
    """Returns an override `METHOD.NAME=VALUE` as a field `methods`.

    Args:
        text: the override.
        fields: the same as nested fields.
        values: fields of the experiment.

    Returns:
        The override, and the fields of the experiment, of which `methods` lists
        all methods; both as given if there is no such method.
    """
    from evaluation.methods import known_methods, shipped_methods

    methods = values.get("methods") or {one: {} for one in shipped_methods()}
    name, _, value = text.partition("=")
    method, _, setting = name.partition(".")
    if method not in (*methods, *known_methods()):
        return fields, values
    if "," in value and not value.lstrip().startswith("["):
        # One list, as on the command lines without factors.
        fields = {method: _nested(setting, [value.split(",")])}
    return {"methods": fields}, {**values, "methods": methods}


def parse_override(text: str) -> dict[str, Any]:
    """Returns a text `FIELD=VALUE` as nested fields of an experiment.

    Raises:
        InputError: the text has another form, or VALUE is not YAML.
    """
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise InputError(f"--set: {text!r} is not FIELD=VALUE")
    with value_errors(f"--set: {name}"):
        parsed = parse_yaml(value)
    return _nested(name, parsed)


def merged(values: Any, changes: Any) -> Any:
    """Returns settings with changes applied.

    Mappings, also nested ones, are changed field by field. All other values are
    replaced as a whole.
    """
    if not (isinstance(values, Mapping) and isinstance(changes, Mapping)):
        return changes
    return {
        **values,
        **{n: merged(values.get(n), one) for n, one in changes.items()},
    }


def _chosen_anew(values: Changes, changes: Changes) -> dict[str, Any]:
    """Returns `merged` fields, with tasks and methods replaced as a whole."""
    chosen = {n: changes[n] for n in ("tasks", "methods") if n in changes}
    return {**merged(values, changes), **chosen}


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
        is_baseline: whether other conditions are compared with this one.
    """

    factors: Changes
    changes: Mapping[str, Changes]
    causes: tuple[tuple[Mapping[str, Changes], ...], ...] = ()
    is_baseline: bool = False


def conditions(experiment: Experiment) -> list[Condition]:
    """Returns the conditions of an experiment, the baseline first.

    Raises:
        ValueError: a factor has no values or the same value twice, the baseline
            names an unknown factor or value, or there are too many conditions.
    """
    fixed, factors = _factors(experiment)
    wanted = dict(_leaves(experiment.baseline, ()))
    first: dict[str, Any] = {}
    for path, values in factors.items():
        asked = wanted.pop(path, values[0])
        if asked not in values:
            raise ValueError(f"baseline.{path}: {asked!r} is no value of it")
        first[path] = asked
    if wanted:
        raise ValueError(f"baseline.{next(iter(wanted))}: this is no factor")
    cases = list(_cases(experiment))
    taken = _changed_paths("", factors.items(), set())
    for name, case in experiment.cases.items():
        if isinstance(case, dict):
            _changed_paths(f"cases.{name}.", _leaves(case, ()), taken)
    lengths = [len(values) for values in factors.values()]
    number = 1 + sum(lengths) - len(lengths)
    if experiment.design == "product":
        number = math.prod(lengths)
    if (number := number * len(cases)) > _MOST_CONDITIONS:
        raise ValueError(f"{number} conditions, more than {_MOST_CONDITIONS}")
    if experiment.design == "product":
        cells = [
            dict(zip(factors, some, strict=True))
            for some in itertools.product(*factors.values())
        ]
        cells.sort(key=lambda cell: cell != first)
    else:
        cells = [first]
        for path, values in factors.items():
            cells += [
                {**first, path: one} for one in values if one != first[path]
            ]
    found = []
    for cell, (cause, level, members) in itertools.product(cells, cases):
        changes: dict[str, Any] = fixed
        for path, value in cell.items():
            changes = merged(changes, _nested(path, value))
        named = {CAUSE: cause, LEVEL: level} if experiment.cases else {}
        found.append(
            Condition(
                {**named, **{n: _table_value(one) for n, one in cell.items()}},
                changes,
                members,
                cause == NO_CAUSE
                and all(
                    value == first[path]
                    for path, value in cell.items()
                    if not path.startswith("protocol.")
                ),
            )
        )
    return found


def _factors(
    experiment: Experiment,
) -> tuple[dict[str, Any], dict[str, list[Any]]]:
    """Returns the fixed fields, and the values of each factor by its path."""
    fixed: dict[str, Any] = {}
    factors: dict[str, list[Any]] = {}
    for side in _FACTORED:
        single, varied = _split_values(getattr(experiment, side), (side,))
        for path, value in single.items():
            if path != FROZEN_REDRAW:
                _set_field(fixed, path, value)
        factors |= {n: some for n, some in varied.items() if n != FROZEN_REDRAW}
    return fixed, factors


def _changed_paths(
    place: str, fields: Iterable[tuple[str, Any]], taken: Set[str]
) -> set[str]:
    """Returns the paths that factors change; refuses those that are taken."""
    found = set(taken)
    for path, values in fields:
        some = values if isinstance(values, list) else [values]
        # A mapping as a value changes several fields.
        paths = {leaf for one in some for leaf, _ in _leaves({path: one}, ())}
        if paths & found:
            path = min(paths & found)
            raise ValueError(f"{place}{path}: another factor changes it, too")
        found |= paths
    return found


def _split_values(
    fields: Changes, above: tuple[str, ...]
) -> tuple[dict[str, Any], dict[str, list[Any]]]:
    """Returns path -> value of fixed fields, and path -> values of factors."""
    single: dict[str, Any] = {}
    varied: dict[str, list[Any]] = {}
    for path, value in _leaves(fields, above):
        if path in single or path in varied:
            raise ValueError(f"{path}: it is there twice")
        if isinstance(value, _Values):
            try:
                _check_once(list(value))
                # Nor may two values have one cell in a table.
                _check_once([str(_table_value(one)) for one in value])
            except ValueError as error:
                raise ValueError(f"{path}: {error}") from None
            varied[path] = list(value)
        else:
            single[path] = value
    return single, varied


class _Values(list):
    """The values of a factor, as a type of its own."""


def _leaves(
    fields: Mapping[Any, Any], above: tuple[str, ...]
) -> Iterator[tuple[str, Any]]:
    """Yields (path, value or values) for each leaf of nested fields."""
    for name, value in fields.items():
        place = (*above, str(name))
        path = ".".join(place)
        if is_spread(value):
            try:
                yield path, _Values(expand_spread(value))
            except ValueError as error:
                raise ValueError(f"{path}: {error}") from None
            continue
        if name == SESSIONS and _is_of(value, dict):
            # Each drive's fields can be factors, named by its number.
            value = {str(k): one for k, one in enumerate(value, start=1)}
        if isinstance(value, dict) and value:
            yield from _leaves(value, place)
            continue
        try:
            json.dumps(value, allow_nan=False, default=str)
        except ValueError:
            raise ValueError(f"{path}: {value} is not finite") from None
        if isinstance(value, list) and not _is_single(name, value):
            if not value:
                raise ValueError(f"{path}: a list without a value")
            yield path, _Values(value)
        else:
            yield path, value


def _is_single(name: str, value: Sequence[Any]) -> bool:
    """Returns whether a list is one value of a field."""
    if name == SESSIONS and _is_of(value, str):
        return True  # Recordings.
    kinds = _LISTS.get(name)
    return kinds is not None and all(isinstance(v, kinds) for v in value)


def _is_of(value: Any, kind: type) -> bool:
    """Returns whether a value is a list, and all of its members of a type."""
    return (
        isinstance(value, list)
        and len(value) > 0
        and all(isinstance(one, kind) for one in value)
    )


def _nested(path: str, value: Any) -> Any:
    for part in reversed(path.split(".")):
        value = {part: value}
    return value


def _set_field(fields: dict[str, Any], path: str, value: Any) -> None:
    """Sets a field to a value, in place: like `merged`, without a copy."""
    *above, name = path.split(".")
    for part in above:
        inner = fields.get(part)
        if not isinstance(inner, dict):
            inner = fields[part] = {}
        fields = inner
    fields[name] = merged(fields.get(name), value)


def _table_value(value: Any) -> Any:
    """Returns a factor's value as a table holds it: a number or text."""
    if value is None:
        return "none"
    if isinstance(value, dict | list):
        text = json.dumps(value, separators=(",", ": ")).replace('"', "")
        return text.strip("{}") or "none"
    return value


def _cases(
    experiment: Experiment,
) -> Iterator[tuple[str, int, tuple[tuple[Case, ...], ...]]]:
    """Yields name, level and members' fields of each case, `none` first."""
    yield NO_CAUSE, 0, ()
    if experiment.levels and not experiment.cases:
        raise ValueError("levels: there are no cases")
    numbers = num_levels(experiment)
    most = max(numbers.values(), default=0)
    if experiment.levels and max(experiment.levels) > most:
        raise ValueError(
            f"levels: no case has level {max(experiment.levels)}; the greatest"
            f" is {most}"
        )
    for name, most in numbers.items():
        members = _member_fields(experiment, name)
        lengths = [_num_levels(one, f"cases.{name}") for one in members]
        wanted = experiment.levels or range(1, most + 1)
        levels = sorted({min(level, most) for level in wanted})
        for level in levels:
            alone = len(members) == 1
            yield (
                name,
                level,
                tuple(
                    tuple(
                        _at_level(one, k)
                        for k in range(level, level - 1 if alone else 0, -1)
                        if k <= length
                    )
                    for one, length in zip(members, lengths, strict=True)
                ),
            )


def num_levels(experiment: Experiment) -> dict[str, int]:
    """Returns the name of each case -> its number of levels.

    Raises:
        ValueError: a case has the name of the condition without a change, or
            combines something that is not a case.
    """
    found = {}
    for name in experiment.cases:
        if name == NO_CAUSE:
            raise ValueError(f"cases.{name}: the name of what has no cause")
        members = _member_fields(experiment, name)
        found[name] = max(_num_levels(one, f"cases.{name}") for one in members)
    return found


def _member_fields(experiment: Experiment, name: str) -> list[Case]:
    """Returns the fields of a case, or those of each case that it combines."""
    case = experiment.cases[name]
    found = []
    for one in case if isinstance(case, tuple) else [name]:
        member = experiment.cases.get(one)
        if not isinstance(member, dict):
            raise ValueError(f"cases.{name}: {one} is no case with fields")
        found.append(member)
    return found


def _num_levels(case: Case, place: str) -> int:
    fields = _leaves(case, (place,))
    return max([len(v) for _, v in fields if isinstance(v, _Values)], default=1)


def _at_level(case: Case, level: int) -> Case:
    """Returns the fields of a case at a level, or the next lower one."""
    fields: Any = {}
    for path, value in _leaves(case, ()):
        if isinstance(value, _Values):
            value = value[min(level, len(value)) - 1]
        _set_field(fields, path, value)
    return fields


# The fields of a protocol that a study can vary. Both gates are measured in any
# case; matches are by distance, and drives differ.
_ProtocolFields = create_model(  # type: ignore[call-overload]  # Fields are computed.
    "_ProtocolFields",
    __config__=ConfigDict(extra="forbid", strict=True, allow_inf_nan=False),
    **{
        name: (kind, None)
        for name, kind in get_type_hints(
            RetrievalProtocol, localns={"PlaceScan": Literal["middle", "first"]}
        ).items()
        if name not in ("gate", "overlap", "exclude_recent")
    },
)


def base_protocol(
    fields: Changes, source: object, place: str = "protocol"
) -> RetrievalProtocol:
    """Returns the protocol that some fields of an experiment describe.

    Args:
        fields: field -> value. The field `base` names a protocol, by default
            `fair`, from which fields that are not given take their values.
        source: file of the experiment, for error messages.
        place: name of the section with these fields, for error messages.

    Raises:
        InputError: a field is unknown or out of range.
    """
    values = dict(fields)
    base = values.pop("base", "fair")
    if base not in PROTOCOLS:
        raise InputError(
            f"{source}: {place}.base: {base!r} is none of"
            f" {', '.join(PROTOCOLS)}"
        )
    validated(_ProtocolFields, values, f"{source}: {place}")
    try:
        return replace(PROTOCOLS[base], **values)
    except InputError as error:
        option, _, fault = str(error).removeprefix("--").partition(":")
        name = option.replace("-", "_")
        raise InputError(f"{source}: {place}.{name}:{fault}") from None


class MethodVariant(NamedTuple):
    """A method with one combination of its settings.

    Attributes:
        name: name of the method, or its Python file.
        settings: (name, value) of each setting, as text.
        columns: path of each setting, such as `methods.solid.ranges` -> its
            value in a table.
    """

    name: str
    settings: tuple[tuple[str, str | tuple[str, ...]], ...]
    columns: Changes


def method_variants(
    methods: Mapping[str, Mapping[str, Any]],
) -> list[MethodVariant]:
    """Returns each method with each combination of its varied settings.

    Args:
        methods: name of a method -> its settings. A setting with a list of
            values is varied.

    Raises:
        ValueError: a setting has no values, or the same value twice.
    """
    found = []
    for name, settings in methods.items():
        place = f"methods.{name}"
        fixed, varied = _split_values(settings, (place,))
        for some in itertools.product(*varied.values()):
            chosen = dict(zip(varied, some, strict=True))
            given = tuple(
                (path.removeprefix(f"{place}."), _setting(one))
                for path, one in {**fixed, **chosen}.items()
            )
            # Fixed ones stand in tables, too: a row says how it was made.
            columns = {
                n: _table_value(one) for n, one in {**fixed, **chosen}.items()
            }
            found.append(MethodVariant(name, given, columns))
    return found


def _setting(value: Any) -> str | tuple[str, ...]:
    return tuple(map(str, value)) if isinstance(value, list) else str(value)
