"""Fields of an experiment's drives that no scenario has, and their limits."""

from collections.abc import Mapping
from importlib.util import find_spec
from typing import Any

from cns_drake.ageing import LAST_YEAR
from cns_drake.base import InputError
from evaluation.map_update import MAINTAINERS, NOT_MAINTAINED
from evaluation.study import FLEET, SESSIONS, Changes

# Fields that only the query can have: they change its scans.
QUERY_FIELDS = ("turn_queries", "tilt_queries", "hide_sector")
# Fields that only the database can have.
DATABASE_FIELDS = (
    FLEET,
    "distractors",
    "lateral",
    SESSIONS,
    "keep",
    "maintain",
)
# Field -> type or types of its value, and the greatest value.
_LIMITS: Mapping[str, tuple[tuple[type, ...], int]] = {
    "distractors": ((int,), 100_000),
    "lateral": ((int, float), 100),
    "years": ((int,), LAST_YEAR),
}


def check_side(place: str, changes: Changes, source: str) -> None:
    """Checks the fields of a drive that no scenario has.

    Args:
        place: path of the drive in the file: `database`, `query` or, for one of
            several drives, a path such as `database.sessions.2`.
        changes: fields of the drive.
        source: file of the experiment, for errors.

    Raises:
        InputError: a field belongs elsewhere, or is out of range.
    """
    if isinstance(changes.get("redraw"), Mapping):
        raise InputError(
            f"{source}: {place}.redraw: give a number, or frozen: it is a field"
            " of both, and of no case"
        )
    is_query = place == "query"
    right = "database" if is_query else "query"
    for name in DATABASE_FIELDS if is_query else QUERY_FIELDS:
        if name in changes:
            raise InputError(
                f"{source}: {place}.{name}: it is a field of {right}"
            )
    for name, (kinds, most) in _LIMITS.items():
        value = changes.get(name, 0)
        if type(value) not in kinds or not 0 <= value <= most:
            raise InputError(
                f"{source}: {place}.{name}: {value!r} is not from 0 to {most}"
            )


def checked_maintainer(value: Any, num_drives: int, where: str) -> str:
    """Returns what updates the maps of a database: its field `maintain`.

    Args:
        value: one of `NOT_MAINTAINED` and `MAINTAINERS`.
        num_drives: number of drives of the database.
        where: file and field, for errors.

    Raises:
        InputError: the value is anything else, there is nothing to update, or a
            package is missing.
    """
    known = (NOT_MAINTAINED, *MAINTAINERS)
    if value not in known:
        raise InputError(f"{where}: {value!r} is none of {', '.join(known)}")
    if value != NOT_MAINTAINED and num_drives == 1:
        raise InputError(
            f"{where}: {value}: no later drive updates the map of a single"
            " one; give several sessions"
        )
    if value == "m3c2" and find_spec("py4dgeo") is None:
        raise InputError(
            f"{where}: m3c2 needs the extra map-update (pip install"
            " 'cns-drake[map-update]')"
        )
    return str(value)
