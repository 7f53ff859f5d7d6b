"""A family: causes of change, one YAML file each in the folder `causes`.

Plug-ins register more. An experiment takes its cases from causes with the field
`causes`:

    causes: {each: ladder}      # a case for each cause, and `all` of them
    causes: {together: levels}  # the case `all`, of all causes

`ladder` and `levels` are names in the section `strengths` of a cause. A cause
without this name is left out. `only: [NAME, ...]` beside `each` keeps the cases
of these causes.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pydantic import Field

from evaluation.base import (
    Family,
    InputError,
    Section,
    did_you_mean,
    merged,
    no_such,
    read_yaml,
    validated,
    value_errors,
)
from evaluation.study.experiments.factors import SIDES, Case

_FOLDER = Path(__file__).parent / "causes"
# The case that combines causes.
ALL = "all"


class Cause(Section):
    """A cause of change between two drives.

    Attributes:
        name: name of the cause, which is the name of its file.
        title: the name in words.
        about: one sentence or part of a sentence: what each level changes.
        scans_only: whether only the scans of the queries change.
        order: place of the cause among all causes.
        combined: whether the case `all` contains the cause.
        strengths: fields of drives for each set of levels, by the name of the
            set. A list of values has the value of each level, the weakest
            first.
    """

    name: str
    title: str
    about: str
    scans_only: bool = False
    order: int = 100
    combined: bool = True
    strengths: dict[str, Case] = Field(min_length=1)

    @property
    def sides(self) -> tuple[str, ...]:
        """The drives that the cause changes; a protocol changes the query's."""
        some = self.strengths.values()
        found = {side for one in some for side in one}
        if "protocol" in found and not found & {*SIDES}:
            found = {"query"}
        return tuple(side for side in SIDES if side in found)


def causes() -> Mapping[str, Cause]:
    """Returns name -> cause of each cause, shipped or registered, in order.

    Example:
        from evaluation import causes

        print(causes()["snow"].strengths["ladder"])
    """
    found = sorted(_CAUSES.values(), key=lambda one: (one.order, one.name))
    return {cause.name: cause for cause in found}


def register_cause(
    cause: Path | str | Mapping[str, Any],
    check: Callable[[Cause], None] = lambda cause: None,
) -> Cause:
    """Registers a cause of change of your own, and returns it.

    Args:
        cause: a YAML file of the fields of `evaluation.study.Cause`, whose
            name is the default of `name`; or a mapping of these fields.
        check: function that raises an InputError for a cause that cannot be
            used.

    Raises:
        InputError: the file cannot be read, or a field is unknown, missing or
            not usable.
        ValueError: there is another cause with this name.

    Example:
        from evaluation import register_cause

        register_cause(
            {
                "name": "deep_snow",
                "title": "Deep snow",
                "about": "60, 80 cm of snow",
                "strengths": {
                    "ladder": {"query": {"transient": {"snow": [0.6, 0.8]}}}
                },
            }
        )
    """
    # It needs more modules than most commands.
    from evaluation.study.experiments.experiment import Experiment

    _CAUSES.load_own()
    found = _read(cause)
    known = {name for one in _CAUSES.own() for name in one.strengths}
    for name, case in found.strengths.items():
        where = f"cause {found.name!r}: strengths.{name}"
        if name not in known and (meant := did_you_mean(name, known)):
            raise InputError(f"{where}: no experiment has it{meant}")
        cases = {found.name: case, ALL: [found.name]}
        values = {"name": "check", "about": "", "cases": cases}
        with value_errors(where):
            # Nobody else's experiments are to fail.
            _ = validated(Experiment, values, where).conditions
    check(found)
    _CAUSES.add(found.name, found, found)
    return found


def source_of_cause(cause: Cause) -> str:
    """Returns the plug-in, if any, and the name of a cause, for messages."""
    return _CAUSES.described(cause.name)


def _load_own() -> None:
    for path in sorted(_FOLDER.glob("*.yaml")):
        cause = _read(path)
        _CAUSES.add(cause.name, cause, cause)


_CAUSES: Family[Cause] = Family("cause", _load_own)


def _read(cause: Path | str | Mapping[str, Any]) -> Cause:
    if isinstance(cause, Mapping):
        name = cause.get("name")
        return validated(Cause, cause, f"cause {name!r}" if name else "cause")
    if not isinstance(cause, Path | str):
        raise InputError(f"{cause!r} is neither a cause nor its file")
    path = Path(cause)
    return validated(Cause, {"name": path.stem, **read_yaml(path)}, path)


def with_cases(values: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Returns fields of an experiment with `cases` in place of `causes`.

    Cases that the fields already have are added, or change those of causes.

    Args:
        values: the fields of an experiment's file.
        path: the file, for error messages.

    Raises:
        InputError: `causes` has another form, or names no strengths.

    Returns:
        The fields; `causes` has `only` alone, if it was given.
    """
    if "causes" not in values:
        return dict(values)
    asked = values["causes"]
    kept = {}
    if isinstance(asked, dict) and "each" in asked and "only" in asked:
        asked = dict(asked)
        kept = {"causes": {"only": asked.pop("only")}}
    if not (isinstance(asked, dict) and len(asked) == 1):
        raise InputError(
            f"{path}: causes: not {{each: ...}} or {{together: ..}}"
        )
    ((form, name),) = asked.items()
    if form not in ("each", "together"):
        raise InputError(f"{path}: causes.{form}: neither each nor together")
    known = causes()
    chosen = {key: one for key, one in known.items() if name in one.strengths}
    if not chosen:
        strengths = {key for one in known.values() for key in one.strengths}
        fault = no_such("strengths", name, sorted(strengths))
        raise InputError(f"{path}: causes.{form}: {fault}")
    combined = [one.name for one in chosen.values() if one.combined]
    cases: dict[str, Any]
    if form == "each":
        cases = {key: one.strengths[name] for key, one in chosen.items()}
        cases[ALL] = combined
    else:
        cases = {ALL: {}}
        for key in combined:
            cases[ALL] = merged(cases[ALL], chosen[key].strengths[name])
    own = values.get("cases", {})
    # The cases stand where the causes stood.
    return kept | {
        ("cases" if key == "causes" else key): (
            merged(cases, own) if key == "causes" else value
        )
        for key, value in values.items()
        if key != "cases"
    }
