"""Conditions of recorded drives, of which only the stage can vary."""

from collections.abc import Sequence

from cns_drake.base import InputError
from cns_drake.studies.experiments.conditions import Condition
from cns_drake.studies.experiments.nested_fields import SESSIONS, SIDES
from cns_drake.studies.experiments.protocol_fields import condition_protocol
from evaluation.recognition import KEEP_ALL, checked_keep
from evaluation.results import CAUSE, LAST, OWN, STAGE
from evaluation.study import (
    MapDrives,
    RecordedCondition,
    RecordingInfo,
    chosen_recordings,
)

# Fields of a database of several recordings.
_OF_RECORDINGS = (f"database.{SESSIONS}", "database.keep")


def recorded_conditions(
    city: MapDrives, conditions: Sequence[Condition], source: str
) -> list[RecordedCondition]:
    """Returns the conditions of an experiment on recordings.

    Args:
        city: the recordings of a map.
        conditions: the conditions.
        source: file of the experiment, for errors.

    Raises:
        InputError: a condition varies what recordings do not allow, or names a
            recording that is missing.
    """
    for one in conditions:
        _check_recordable(city, one, source)
    return [
        RecordedCondition(
            one.factors,
            one.changes.get("both", {}).get("stage", OWN),
            one.is_baseline,
            condition_protocol(one, source),
            _database(city, one, source),
            checked_keep(
                one.changes.get("database", {}).get("keep", KEEP_ALL),
                f"{source}: database.keep",
            ),
        )
        for one in conditions
    ]


def _database(
    city: MapDrives, condition: Condition, source: str
) -> tuple[RecordingInfo, ...]:
    """Returns the recordings of a database of several recordings."""
    names = condition.changes.get("database", {}).get(SESSIONS)
    if names is None:
        return ()
    where = f"{source}: database.{SESSIONS}"
    is_list = isinstance(names, list) and bool(names)
    if not (is_list and all(isinstance(one, str) for one in names)):
        raise InputError(f"{where}: not a list of names of recordings")
    return chosen_recordings(city, names, where)


def _check_recordable(
    city: MapDrives, condition: Condition, source: str
) -> None:
    """Checks that a condition varies only the stage, as recordings require."""
    sides = {n: condition.changes.get(n, {}) for n in SIDES}
    given = [f"{side}.{name}" for side in sides for name in sides[side]]
    if SESSIONS in sides["database"]:
        given = [one for one in given if one not in _OF_RECORDINGS]
        if sides["both"]:
            raise InputError(
                f"{source}: {STAGE}: databases of several"
                " recordings have no control"
            )
    given += [CAUSE] if condition.causes else []
    for name in given:
        if name != STAGE:
            name = next(
                (n for n in condition.factors if n.startswith(name)),
                name,
            )
            raise InputError(
                f"{source}: {name}: the recordings of {city.name}"
                " are as they are; simulated drives alone can vary it"
            )
    stage = sides["both"].get("stage", OWN)
    if stage not in (OWN, LAST):
        raise InputError(
            f"{source}: {STAGE}: {stage!r}: recordings have {OWN} and {LAST}"
        )
