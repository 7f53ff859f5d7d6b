"""Removes structures of a city at random, by class."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from cns_drake.base.csv_files import read_records
from cns_drake.base.errors import InputError


def is_on_a_lot(row: Mapping[str, str]) -> bool:
    """Returns whether a structure occupies a lot only until it is built on."""
    tags = (row.get("tags") or "").split()
    return "_lot_" in row["name"] and "lot" in tags


def draw_losses(
    table: Path, parts: Mapping[str, float], seed: int, source: object
) -> frozenset[str]:
    """Draws the missing structures, each class independently.

    A greater part includes all structures of a smaller one.

    Args:
        table: of all structures.
        parts: class -> missing part of its structures, 0 to 1.
        seed: of the draw.
        source: the file that errors name.

    Raises:
        InputError: the table cannot be read or has no structure of a class.
    """
    rows = [
        row
        for _, row in read_records(table, ("name", "class"))
        if not is_on_a_lot(row)
    ]
    missing: set[str] = set()
    for kind, part in parts.items():
        names = sorted(row["name"] for row in rows if row["class"] == kind)
        if not names:
            raise InputError(f"{source}: scattered: no {kind!r} in {table}")
        rng = np.random.default_rng([seed, *kind.encode()])
        order = rng.permutation(len(names))
        missing.update(names[k] for k in order[: round(part * len(names))])
    return frozenset(missing)
