"""Causes of change, checked against the fields of drives."""

from collections.abc import Mapping
from contextlib import suppress
import functools
from pathlib import Path
from typing import Any

from cns_drake.scenarios import Scenario, load_scenario
from cns_drake.studies.drives.changed_drives import DATABASE_FIELDS, check_side
from cns_drake.studies.drives.named_stages import MissingError, find_stage
from evaluation.base import InputError, errors_at, note
from evaluation.results import OWN
from evaluation.study import (
    SIDES,
    Case,
    Cause,
    Experiment,
    protocol_from_fields,
    source_of_cause,
)
from evaluation.study import causes as all_causes
from evaluation.study import register_cause as register_any_cause

# A small map with all stages and recorded traffic.
_DRIVE = "suburbia_02"


def causes() -> Mapping[str, Cause]:
    """Returns name -> cause of each cause, shipped or registered, in order.

    A note names each cause that changes what no drive has, or to a value that
    no drive can have; it is left out.

    Example:
        from cns_drake import causes

        print(causes()["snow"].strengths["ladder"])
    """
    found = dict(all_causes())
    for name in [*found]:
        if fault := cause_fault(found[name]):
            note(f"left out: {fault}")
            del found[name]
    return found


def register_cause(cause: Path | str | Mapping[str, Any]) -> Cause:
    """Registers a cause of change of your own, and returns it.

    As `evaluation.register_cause`, and its fields are checked against those of
    a drive.

    Args:
        cause: a YAML file of the fields of `evaluation.study.Cause`, whose
            name is the default of `name`; or a mapping of these fields.

    Raises:
        InputError: the file cannot be read, or a field is unknown, missing or
            not usable.
        ValueError: there is another cause with this name.

    Example:
        from cns_drake import register_cause

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
    return register_any_cause(cause, _check)


def _check(cause: Cause) -> None:
    if fault := cause_fault(cause):
        raise InputError(fault)


def cause_fault(cause: Cause) -> str:
    """Returns what is wrong with a cause, with its name; "" if it is usable.

    The fields of all levels are checked on a shipped drive, without its world.
    """
    for name, case in cause.strengths.items():
        if fault := _fault(case):
            return f"{source_of_cause(cause)}: strengths.{name}.{fault}"
    return ""


def _fault(case: Case) -> str:
    """Returns what is wrong with a case; "" if it can be used."""
    experiment = Experiment(name="check", about="", cases={"case": case})
    for condition in experiment.conditions:
        for at_level in condition.causes:
            try:
                _check_fields(at_level[0])
            except InputError as error:
                return str(error).removeprefix("case: ")
    return ""


def _check_fields(fields: Mapping[str, Mapping[str, Any]]) -> None:
    """Checks the fields of a case at one level, on the drive of a map."""
    drive = _drive()
    protocol_from_fields(fields.get("protocol", {}), "case")
    for side in set(SIDES) & {*fields}:
        place = "database" if side == "both" else side
        check_side(place, fields[side], "case")
        left = {
            name: one
            for name, one in fields[side].items()
            # A mapping is a route that is sampled, of each map another.
            if name not in (*DATABASE_FIELDS, "stage")
            and not (name == "route" and isinstance(one, Mapping))
        }
        # Other maps may have what this one lacks.
        with suppress(MissingError), errors_at(f"case: {side}.stage"):
            stage = fields[side].get("stage", OWN)
            find_stage(stage, drive, str(drive.stage))
        drive.with_fields(left, f"case: {side}")


@functools.cache
def _drive() -> Scenario:
    return load_scenario(_DRIVE)
