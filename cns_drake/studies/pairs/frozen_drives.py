"""Drives of frozen comparisons, which stay the same in all releases."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from cns_drake.base import InputError, fingerprint, read_records, whole_number
from cns_drake.scenarios import combined_digest, digest_inputs, worlds_folder
from cns_drake.studies.pairs.comparisons import ComparedDrives

# Columns of a table of frozen drives.
_FROZEN = ("map", "level", "drives")


def frozen_drives(table: str) -> dict[tuple[str, int], str]:
    """Reads a table of drives that must stay the same in all releases.

    Args:
        table: name of a CSV file in the folder of the shipped worlds.

    Returns:
        (map, level) -> fingerprint, a hash of the drives that are compared. The
        level is the degree of difficulty, see `docs/levels.md`.

    Raises:
        InputError: there is no such file, or a level is not a number.
    """
    path = worlds_folder() / table
    return {
        (
            row["map"],
            whole_number(row["level"], f"{path}: line {line}: level"),
        ): row["drives"]
        for line, row in read_records(path, _FROZEN)
    }


def drives_fingerprint(
    compared: ComparedDrives, worlds: dict[Path, str]
) -> str:
    """Returns a hash of all drives and of the cities along these drives.

    Args:
        compared: the drives.
        worlds: cache, world file -> digest of the files of its world. This
            function adds the digests of the worlds of these drives.

    Raises:
        InputError: a file of a world cannot be read.
    """
    for drive in compared.drives:
        if drive.world_file not in worlds:
            worlds[drive.world_file] = combined_digest(digest_inputs(drive))
    return fingerprint(
        {
            "drives": compared.fingerprint(),
            "worlds": [worlds[one.world_file] for one in compared.drives],
        }
    )


def check_frozen(
    table: str, compared: Mapping[tuple[str, int], Sequence[str]]
) -> None:
    """Checks that the drives of a comparison are listed in a table.

    Maps that are not in the table are not checked.

    Args:
        table: name of a file in the folder of the shipped worlds; see
            `frozen_drives`.
        compared: (map, level) -> fingerprints of the compared drives. Levels
            are degrees of difficulty, see `docs/levels.md`.

    Raises:
        InputError: a fingerprint differs from the table's.
    """
    frozen = frozen_drives(table)
    for (name, level), prints in compared.items():
        wanted = frozen.get((name, level))
        if wanted not in (None, fingerprint({"drives": list(prints)})):
            raise InputError(
                f"{table}: level {level} of {name}: the experiment's drives are"
                " not the frozen ones; leave out `frozen` to measure them"
            )
