"""Reads experiments from files, with changes to single fields."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
import contextlib
from pathlib import Path
import re
from typing import Any, NamedTuple

import yaml

from evaluation.base import (
    InputError,
    did_you_mean,
    errors_at,
    merged,
    nested,
    no_such,
    parse_changes,
    read_yaml,
    validated,
    value_errors,
)
from evaluation.methods import SETTINGS
from evaluation.recognition import expanded_names
from evaluation.results import as_factor
from evaluation.study.experiments.cause_files import ALL, with_cases
from evaluation.study.experiments.experiment import (
    Experiment,
    in_long_form,
    levels_by_case,
    named_programs,
)
from evaluation.study.experiments.factors import Changes

_FOLDER = Path(__file__).parent


def shipped_experiments() -> dict[str, Path]:
    """Returns name -> file of the shipped experiments."""
    return {path.stem: path for path in sorted(_FOLDER.glob("*.yaml"))}


def experiment_text(name_or_file: str | Path) -> str:
    """Returns an experiment's file, with the cases for which its causes stand.

    Raises:
        InputError: there is no such experiment, or it cannot be used.
    """
    load_experiment(name_or_file)
    path = _experiment_file(name_or_file)
    text = path.read_text("utf-8")
    values = read_yaml(path)
    if "causes" not in values:
        return text
    cases = yaml.safe_dump(
        {"cases": with_cases(values, path)["cases"]},
        sort_keys=False,
        default_flow_style=None,
        allow_unicode=True,
        width=79,
    )
    line = re.compile(r"^causes:.*\n(?:[ #].*\n)*", re.MULTILINE)
    return line.sub(lambda _: cases, text)


def load_experiment(
    name_or_file: str | Path,
    overrides: Iterable[str | tuple[str, Any]] = (),
    *,
    quick: bool = False,
    tasks: Sequence[str] = (),
    methods: Sequence[str] = (),
    allow_code: bool = True,
) -> Experiment:
    """Reads an experiment.

    Args:
        name_or_file: a shipped experiment by name, or a file.
        overrides: fields to change. Each is a text `FIELD=VALUE`, or a pair of
            a top-level field and its value. In a text, VALUE is YAML and dots
            separate nested fields, as in `database.city.missing=[0, 0.3]`.
        quick: whether the fields in the section `quick` of the experiment
            replace its other fields.
        tasks: tasks to measure instead of the experiment's tasks; the settings
            of the experiment stay.
        methods: methods to run, in the same way; `standard` stands for all
            standard methods.
        allow_code: whether the file may name Python files, which a study runs.
            Those of the other arguments are the user's own.

    Raises:
        InputError: there is no such experiment, a field is unknown or not
            usable, or the file names a program that may not run.
    """
    overrides = list(overrides)
    methods = expanded_names(methods)
    found = _loaded(name_or_file, overrides, quick, tasks, methods)
    if not allow_code:
        # Others may have written the file.
        own = named_programs([methods, [*map(_fields_of, overrides)]])
        for field in ("methods", "metrics", "tasks"):
            for file in named_programs(getattr(found, field)):
                if file not in own:
                    raise InputError(
                        f"{name_or_file}: {field}: {file} is a program, and"
                        " would run with your permissions; read it, then add"
                        " --allow-code"
                    )
    return found


def _loaded(
    name_or_file: str | Path,
    overrides: Sequence[str | tuple[str, Any]],
    quick: bool,
    tasks: Sequence[str],
    methods: Sequence[str],
) -> Experiment:
    path = _experiment_file(name_or_file)
    values = read_yaml(path)
    if not isinstance(values, dict):
        raise InputError(f"{path}: not a mapping of an experiment's fields")
    values = with_cases(values, path)
    values = in_long_form({"name": path.stem, **values})
    short = values.get("quick")
    chosen = {"tasks": tasks, "methods": methods}
    if quick:
        if not isinstance(short, dict):
            raise InputError(
                f"{path}: quick: missing, or no mapping; --quick needs this"
                " section, with the fields to replace"
            )
        changed = _chosen_anew(values, short)
        return _checked(changed, values, path, overrides, chosen)
    found = _checked(values, values, path, overrides, chosen)
    if isinstance(short, dict) and short:
        # A fault of the section is told before it is used.
        with errors_at(f"{path}: quick", f"{path}: "):
            changed = _chosen_anew(values, short)
            _checked(changed, values, path, overrides, chosen)
    return found


def _checked(
    values: Changes,
    written: Changes,
    path: Path,
    overrides: Sequence[str | tuple[str, Any]],
    chosen: Mapping[str, Sequence[str]],
) -> Experiment:
    """Returns an experiment whose conditions are known to be usable.

    Args:
        values: the fields of the experiment, in long form.
        written: the fields of the file without those of `quick`, whose factors
            charts may name, too.
        overrides: see `load_experiment`.
        chosen: names of tasks and methods that replace those of the experiment.
    """
    place: Path | str = path
    if overrides:
        file_alone = _without_causes(values)
        with contextlib.suppress(InputError):
            validated(Experiment, file_alone, path)
            # A fault that is still found is in what replaces its fields.
            place = "--set"
    for one in overrides:
        values = _overridden(values, one)
    values = in_long_form(dict(values))
    only = values.pop("causes", None)
    for field, names in chosen.items():
        if names:
            given = values.get(field)
            given = given if isinstance(given, dict) else {}
            values[field] = {name: given.get(name, {}) for name in names}
    experiment = validated(Experiment, values, place)
    with value_errors(place):
        if only is not None:
            experiment = _with_causes(experiment, only)
        known = _Measured.of(experiment)
    written = _without_causes(written)
    if values != written or only is not None:
        # What an option has left out is still known.
        with contextlib.suppress(InputError, ValueError):
            known = known.joined(
                _Measured.of(validated(Experiment, written, path))
            )
    _check_charts(experiment, known, path)
    return experiment


def _without_causes(values: Changes) -> dict[str, Any]:
    return {name: one for name, one in values.items() if name != "causes"}


def _with_causes(experiment: Experiment, asked: Any) -> Experiment:
    """Returns an experiment with some of its causes.

    Args:
        experiment: the experiment; its case `all` combines others.
        asked: the field `causes`: the key `only` with one name or several.

    Raises:
        ValueError: `causes` has another form, or names no case.
    """
    names = None
    if isinstance(asked, dict) and list(asked) == ["only"]:
        names = asked["only"]
    names = [names] if isinstance(names, str) else names
    if not isinstance(names, list) or not names:
        raise ValueError("causes: choose some by causes.only=[NAME, ...]")
    known = [name for name in experiment.cases if name != ALL]
    for name in names:
        if name not in known:
            raise ValueError(f"causes.only: {no_such('case', name, known)}")
    cases = {name: experiment.cases[name] for name in known if name in names}
    combined = experiment.cases.get(ALL, ())
    together = tuple(name for name in combined if name in names)
    if len(together) > 1:
        cases[ALL] = together
    found = experiment.replaced(cases=cases)
    most = max(levels_by_case(found).values())
    levels = {min(level, most) for level in found.levels or ()}
    return found.replaced(levels=tuple(sorted(levels))) if levels else found


class _Measured(NamedTuple):
    """What charts can show: factors, their values, and tasks.

    Attributes:
        values: column -> the values that rows can have there. Columns whose
            values are known only after the study are left out.
    """

    factors: tuple[str, ...]
    values: Mapping[str, Collection[Any]]

    @classmethod
    def of(cls, experiment: Experiment) -> _Measured:
        # The task `cost` is added to some studies.
        tasks = (*experiment.tasks, "cost")
        values: dict[str, dict[Any, None]] = {"task": dict.fromkeys(tasks)}
        for condition in experiment.conditions:
            for name, value in condition.factors.items():
                values.setdefault(name, {})[as_factor(value)] = None
        return cls(tuple(experiment.factor_names), values)

    def joined(self, other: _Measured) -> _Measured:
        return _Measured(
            (*self.factors, *other.factors),
            {
                name: dict.fromkeys(
                    [*self.values.get(name, ()), *other.values.get(name, ())]
                )
                for name in (*self.values, *other.values)
            },
        )


def _check_charts(experiment: Experiment, known: _Measured, path: Path) -> None:
    """Checks that charts show what an experiment measures.

    Settings of methods, and metrics of the user, are known once their files
    have run: `run_study` checks them.
    """
    if not experiment.charts:
        return
    # It needs Matplotlib, which takes long to load.
    from evaluation.results import chart_factors, check_factors

    has_own = bool(named_programs(experiment.metrics))
    factors = [*dict.fromkeys(known.factors)]
    for chart in experiment.charts:
        with errors_at(path):
            names = [
                name
                for name in chart_factors(chart)
                if not name.startswith(SETTINGS)
                and not (has_own and name in (chart.get("x"), chart.get("y")))
            ]
            check_factors(chart, names, factors)
            if chart["kind"] == "lines":
                for one in known.values.get(chart["over"], ()):
                    if isinstance(one, str):
                        raise InputError(
                            f"charts: lines: over: {chart['over']}: {one!r} is"
                            " no number; take dumbbell or matrix"
                        )
            for name, value in chart.items():
                chosen = value if isinstance(value, list) else [value]
                there = known.values.get(name, chosen)
                for one in chosen:
                    if one not in there:
                        listed = ", ".join(map(str, there))
                        raise InputError(
                            f"charts: {chart['kind']}: {name}: {one!r} is none"
                            f" of {listed}"
                        )


def _experiment_file(name_or_file: str | Path) -> Path:
    shipped = shipped_experiments()
    path = shipped.get(str(name_or_file), Path(name_or_file))
    if not path.is_file():
        raise InputError(
            f"{name_or_file}: neither an experiment of this package "
            f"({', '.join(shipped)}) nor a file"
            f"{did_you_mean(name_or_file, shipped)}"
        )
    return path


def _chosen_anew(values: Changes, changes: Changes) -> dict[str, Any]:
    """Returns `merged` fields, with tasks and methods replaced as a whole."""
    chosen = {n: changes[n] for n in ("tasks", "methods") if n in changes}
    return {**merged(values, changes), **chosen}


def _fields_of(override: str | tuple[str, Any]) -> dict[str, Any]:
    if isinstance(override, str):
        return parse_changes([override])
    return dict([override])


def _overridden(
    values: Changes, override: str | tuple[str, Any]
) -> dict[str, Any]:
    """Returns fields of an experiment with an override."""
    fields = _fields_of(override)
    if not isinstance(override, str):
        return {**values, **fields}
    if "." not in override.partition("=")[0]:
        return _chosen_anew(values, fields)
    (first,) = fields
    if first not in Experiment.model_fields:
        return _with_method_setting(values, override)
    return merged(values, fields)


def _with_method_setting(values: Changes, override: str) -> dict[str, Any]:
    """Returns an experiment's fields, changed by METHOD.SETTING=VALUE.

    If METHOD is not the name of a method, it becomes an unknown field.
    """
    from evaluation.methods import known_methods, shipped_methods

    fields = parse_changes([override])
    methods = values.get("methods") or {one: {} for one in shipped_methods()}
    name, _, value = override.partition("=")
    method, _, setting = name.partition(".")
    if method not in (*methods, *known_methods()):
        return merged(values, fields)
    if "," in value and not value.lstrip().startswith("["):
        # One list, as on the command lines without factors.
        fields = {method: nested(setting, [value.split(",")])}
    return merged({**values, "methods": methods}, {"methods": fields})
