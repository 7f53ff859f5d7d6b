"""Causes of change, checked against the fields of drives."""

from collections.abc import Iterable, Mapping
import contextlib
import functools
from typing import Any

from cns_drake.scenarios import Scenario, load_scenario
from cns_drake.studies.drives.named_stages import MissingError
from cns_drake.studies.pairs.comparisons import PairMaker
from evaluation.base import InputError, merged
from evaluation.study import Case, Cause, Experiment, source_of_cause
from evaluation.study import causes as all_causes
from evaluation.study import register_cause as register_cause

# A small map with all stages and recorded traffic.
_DRIVE = "suburbia_02"


def causes() -> Mapping[str, Cause]:
    """Returns name -> cause of each cause, shipped or registered, in order.

    Raises:
        InputError: a cause changes what no drive has, or to a value that no
            drive can have.

    Example:
        from cns_drake import causes

        print(causes()["snow"].strengths["ladder"])
    """
    found = all_causes()
    check_causes(found.values())
    return found


def check_causes(some: Iterable[Cause]) -> None:
    """Checks all levels of causes on a shipped drive, without its world.

    Raises:
        InputError: see `causes`.
    """
    query = load_scenario(_DRIVE)
    database = query.replaced(name=f"{_DRIVE}_database")
    for cause in some:
        source = source_of_cause(cause)
        pair = PairMaker(
            database,
            query,
            same_route=True,
            source=source,
            age=_unmade,
            redraw=_unmade,
            on_note=lambda note: None,
        )
        for name, case in cause.strengths.items():
            fault = _fault(pair, cause.name, case)
            # A cause of the levels may need others, such as rain noisy returns.
            if fault and _fault(pair, cause.name, _among_all(name, case)):
                raise InputError(f"{source}: strengths.{name}.{fault}")


def _unmade(drive: Scenario, *_: Any) -> tuple[str, str]:
    """Returns the map and stage of a drive for those that a study makes."""
    return str(drive.map), str(drive.stage)


def _fault(pair: PairMaker, name: str, case: Case) -> str:
    """Returns what is wrong with a case; "" if it can be used."""
    experiment = Experiment(name="check", about="", cases={name: case})
    for condition in experiment.conditions:
        # Other maps may have what this one lacks.
        with contextlib.suppress(MissingError):
            try:
                pair.build(condition, 0)
            except InputError as error:
                place = f"{pair.source}: "
                return (
                    str(error)
                    .removeprefix(place)
                    .removeprefix(f"cases.{name}.")
                )
    return ""


def _among_all(strength: str, case: Case) -> Case:
    """Returns a case with the fields of all causes with the same strength."""
    cases = [one.strengths.get(strength, {}) for one in all_causes().values()]
    return functools.reduce(merged, [*cases, case], {})
