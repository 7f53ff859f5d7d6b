"""Builds a city with its table of drives: a wall, since cities need shapely."""

from collections.abc import Callable
from pathlib import Path

from cns_drake.scenarios.drive_table import check_table, write_table
from evaluation.base import note
from worlds.city import generate_city, start_city


def build_city(
    folder: Path,
    *,
    new: bool = False,
    seed: int = 0,
    repair_stages: bool = False,
    on_note: Callable[[str], None] = note,
) -> list[Path]:
    """Builds the stages of a city, as `cns-drake city` does.

    Returns the generated files of the stages. The table of the map's drives is
    updated, too.

    Args:
        folder: folder with `roads.yaml`, `city.yaml` and `stages.yaml`.
        new: whether to write those of these files that are missing, and drives,
            but for `roads.yaml`; see `start_city`.
        seed: seed of these files.
        repair_stages: whether to update names in `stages.yaml`; see
            `generate_city`.
        on_note: is called with notes for the user.

    Raises:
        InputError: a file cannot be used or written.
    """
    check_table(folder)
    if new:
        start_city(folder, seed, on_note)
    files = generate_city(folder, on_note, repair_stages=repair_stages)
    write_table(folder)
    return files
