"""Frozen experiments: their drives stay as they were when they were frozen."""

from collections.abc import Mapping, Sequence

from cns_drake.base.csv_files import read_records
from cns_drake.base.errors import InputError
from cns_drake.base.jobs.fingerprint import fingerprint
from cns_drake.scenarios.shipped import worlds_folder

_COLUMNS = ("map", "level", "drives")


def frozen_drives(table: str) -> dict[tuple[str, int], str]:
    """Returns (map, level) -> fingerprint of the drives when frozen.

    Args:
        table: a file of the shipped worlds.

    Raises:
        InputError: there is no such file.
    """
    rows = read_records(worlds_folder() / table, _COLUMNS)
    return {(row["map"], int(row["level"])): row["drives"] for _, row in rows}


def check_frozen(
    table: str, compared: Mapping[tuple[str, int], Sequence[str]]
) -> None:
    """Checks that drives of frozen conditions still have their fingerprints.

    Maps that the table lacks are not checked.

    Args:
        table: a file of the shipped worlds.
        compared: (map, level) -> fingerprints of what is compared.

    Raises:
        InputError: one is another.
    """
    frozen = frozen_drives(table)
    for (name, level), prints in compared.items():
        wanted = frozen.get((name, level))
        if wanted not in (None, fingerprint({"drives": list(prints)})):
            raise InputError(
                f"{table}: level {level} of {name}: the experiment's drives are"
                " not the frozen ones; leave out `frozen` to measure them"
            )
