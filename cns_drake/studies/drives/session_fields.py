"""Fields of each drive of a database, which an experiment lists or samples."""

from collections.abc import Mapping
from typing import Any

from cns_drake.base import InputError, validated
from cns_drake.studies.drives.sampled_drives import Fleet
from cns_drake.studies.drives.side_fields import DATABASE_FIELDS
from cns_drake.studies.experiments.nested_fields import (
    FLEET,
    SESSIONS,
    Changes,
    merged,
)

# Fields that all drives of a database share.
_SHARED_FIELDS = (*DATABASE_FIELDS, "rates")
# Fields that describe a database, not its drives.
_OF_DATABASE = ("keep", "maintain")
# Fields that put a drive into another frame of reference.
_FRAME_FIELDS = ("map", "world")


def session_fields(
    database: Changes, seed: int, source: str
) -> dict[str, dict[str, Any]]:
    """Returns the fields of each drive of a database.

    Each drive has the fields of the database. A field of the drive's own
    replaces the same field of the database.

    Args:
        database: fields of the database.
        seed: seed of a fleet that has no own seed.
        source: file of the experiment, for errors.

    Returns:
        The fields of each drive, by the path of the drive in the file, such as
        `database.sessions.2`.

    Raises:
        InputError: the drives are not a list of mappings, or a drive has a
            field that it cannot have.
    """
    shared = dict(database)
    for name in _OF_DATABASE:
        shared.pop(name, None)
    if FLEET in database:
        sessions: Any = _fleet_sessions(database, seed, source)
        del shared[FLEET]
    elif SESSIONS in database:
        sessions = shared.pop(SESSIONS)
    else:
        return {"database": shared}
    if isinstance(sessions, Mapping):
        # A factor of a drive makes the list a mapping of its numbers.
        numbers = [str(k) for k in range(1, len(sessions) + 1)]
        is_list = list(sessions) == numbers
        sessions = list(sessions.values()) if is_list else None
    if not (isinstance(sessions, list) and sessions):
        raise InputError(
            f"{source}: database.{SESSIONS}: not a list of one drive or more"
        )
    found = {}
    for number, own in enumerate(sessions, start=1):
        place = f"database.{SESSIONS}.{number}"
        _check_own_fields(own, f"{source}: {place}")
        found[place] = merged(shared, own)
    return found


def _fleet_sessions(
    database: Changes, seed: int, source: str
) -> list[dict[str, Any]]:
    where = f"{source}: database.{FLEET}"
    if SESSIONS in database:
        raise InputError(f"{where}: give it or {SESSIONS}")
    fleet = database[FLEET]
    if isinstance(fleet, Mapping):
        fleet = {"seed": seed, **fleet}
    return validated(Fleet, fleet, where).sessions()


def _check_own_fields(own: Any, where: str) -> None:
    if not isinstance(own, Mapping):
        raise InputError(f"{where}: {own!r} is no mapping of fields")
    for name in _FRAME_FIELDS:
        if name in own:
            raise InputError(
                f"{where}.{name}: another map has another frame of reference"
                " than the other drives"
            )
    for name in _SHARED_FIELDS:
        if name in own:
            raise InputError(
                f"{where}.{name}: all drives share it; it is a field of"
                " database"
            )


def session_factors(place: str, factors: Changes) -> dict[str, Any]:
    """Returns the factors of a condition that concern a drive of a database.

    Factors of this drive are named as if it were the only drive. Factors of
    other drives, and factors of the whole database, are left out.

    Args:
        place: path of the drive in the file, such as `database.sessions.2`.
        factors: name -> value, for all factors of the condition.
    """
    several = tuple(f"database.{name}" for name in (SESSIONS, FLEET))
    shared = tuple(f"database.{name}" for name in _OF_DATABASE)
    found = {}
    for path, value in factors.items():
        if path.startswith(f"{place}."):
            path = f"database.{path.removeprefix(place)[1:]}"
        elif path.startswith(several) or path in shared:
            continue
        found[path] = value
    return found


def years_aged(database: Changes, sessions: Mapping[str, Changes]) -> int:
    """Returns by how many years the city of the query is aged.

    The result is the greatest of the fields `years` of the drives and of the
    database. The field of the database counts even if each drive has its own
    field, so that databases with different drives can have the same query.

    Args:
        database: fields of the database.
        sessions: maps the path of each drive in the file to the drive's fields.
    """
    return max(one.get("years", 0) for one in (database, *sessions.values()))
