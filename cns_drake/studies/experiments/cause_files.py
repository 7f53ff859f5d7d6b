"""A family: causes of change, one YAML file each in the folder `causes`.

An experiment takes its cases from these files with the field `causes`:

    causes: {each: ladder}      # a case for each cause, and `all` of them
    causes: {together: levels}  # the case `all`, of all causes

`ladder` and `levels` are names in the section `strengths` of a cause. A cause
without this name is left out.
"""

from collections.abc import Mapping
import functools
from pathlib import Path
from typing import Any

from pydantic import Field

from cns_drake.base import InputError, did_you_mean, read_yaml, validated
from cns_drake.sensors import Section
from cns_drake.studies.experiments.nested_fields import SIDES, Case, merged

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
    order: int
    combined: bool = True
    strengths: dict[str, Case] = Field(min_length=1)

    @property
    def sides(self) -> tuple[str, ...]:
        """The drives that the cause changes."""
        some = self.strengths.values()
        return tuple(side for side in SIDES if any(side in one for one in some))


@functools.cache
def shipped_causes() -> Mapping[str, Cause]:
    """Returns name -> cause, in order.

    Raises:
        InputError: a file cannot be used.
    """
    found = [
        validated(Cause, {"name": path.stem, **read_yaml(path)}, path)
        for path in _FOLDER.glob("*.yaml")
    ]
    found.sort(key=lambda cause: (cause.order, cause.name))
    return {cause.name: cause for cause in found}


def with_cases(values: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Returns fields of an experiment with `cases` in place of `causes`.

    Cases that the fields already have are added, or change those of causes.

    Args:
        values: the fields of an experiment's file.
        path: the file, for error messages.

    Raises:
        InputError: `causes` has another form, or names no strengths.
    """
    if "causes" not in values:
        return dict(values)
    asked = values["causes"]
    if not (isinstance(asked, dict) and len(asked) == 1):
        raise InputError(
            f"{path}: causes: not {{each: ...}} or {{together: ..}}"
        )
    ((form, name),) = asked.items()
    if form not in ("each", "together"):
        raise InputError(f"{path}: causes.{form}: neither each nor together")
    causes = {
        cause.name: cause
        for cause in shipped_causes().values()
        if name in cause.strengths
    }
    if not causes:
        known = {one for c in shipped_causes().values() for one in c.strengths}
        raise InputError(
            f"{path}: causes.{form}: no strengths {name!r} (known:"
            f" {', '.join(sorted(known))}){did_you_mean(str(name), known)}"
        )
    combined = [one.name for one in causes.values() if one.combined]
    cases: dict[str, Any]
    if form == "each":
        cases = {key: one.strengths[name] for key, one in causes.items()}
        cases[ALL] = combined
    else:
        cases = {ALL: {}}
        for key in combined:
            cases[ALL] = merged(cases[ALL], causes[key].strengths[name])
    own = values.get("cases", {})
    # The cases stand where the causes stood.
    return {
        ("cases" if key == "causes" else key): (
            merged(cases, own) if key == "causes" else value
        )
        for key, value in values.items()
        if key != "cases"
    }
