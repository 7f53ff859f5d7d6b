"""Structures that an experiment removes from the city of a drive.

A share of the buildings and plants is missing. The missing structures are the
structures nearest to a random place, so a drive with a greater share lacks
everything that a drive with a smaller share lacks. The removed structures can
also be limited to structures that an earlier stage lacks; the city is then
between the two stages. In addition, structures of chosen classes can be missing
at random.
"""

from collections.abc import Mapping, Set
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from cns_drake.base import InputError, read_records
from cns_drake.scenarios import Scenario, check_files
from cns_drake.scene import load_world, structures_in
from cns_drake.sensors import Section

# Classes of structures that can be missing; streets, ground and street
# furniture always stay.
_REMOVABLE = ("building", "vegetation")
# Farther than any city reaches [m].
_FARTHEST = 1e6
# The key of `scattered` that is no class.
_SEED = "seed"

_Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Losses(Section):
    """What is missing from the city of a drive.

    Attributes:
        missing: share of the buildings and plants to remove, from 0 to 1. The
            seed of the condition selects a place, and the structures nearest to
            this place are removed.
        scattered: structures to remove at random all over the map, in addition
            to the share `missing`: for each class that you name, the share of
            its structures to remove, such as `{pole: 0.3}`. The key `seed`
            replaces the seed of the condition, so that the two drives can lack
            different structures.
        towards: another stage of the map, usually an earlier stage. Only
            structures that do not exist in that stage are removed. A structure
            that exists in that stage does not change, even if it has another
            height in that stage.
    """

    missing: _Share = 0.0
    scattered: dict[str, float] = Field(default_factory=dict)
    towards: str | None = None


def lost_structures(
    drive: Scenario, losses: Losses, seed: int, source: str
) -> tuple[str, ...]:
    """Returns the names of the structures that a drive's city loses, sorted.

    Args:
        drive: a drive through a stage of a map.
        losses: what is missing.
        seed: seed of the random samples.
        source: file and section of the losses, for error messages.

    Raises:
        InputError: the drive has no map, a stage or class does not exist, a
            share is not from 0 to 1, or the map's table of structures cannot be
            used.
    """
    if drive.map is None:
        raise InputError(
            f"{source}: missing: {drive.name} has no map with structures"
        )
    scattered = dict(losses.scattered)
    own_seed = scattered.pop(_SEED, seed)
    if own_seed < 0 or own_seed != int(own_seed):
        raise InputError(
            f"{source}: scattered.seed: {own_seed} is no whole number from 0"
        )
    for kind, share in scattered.items():
        if not 0.0 <= share <= 1.0:
            raise InputError(
                f"{source}: scattered.{kind}: {share} is not from 0 to 1"
            )
    removable = None
    if losses.towards is not None:
        stage = str(drive.stage)
        removable = _lacking_in(drive, stage, losses.towards, source)
    table = drive.folder.structures
    lost = _scattered_losses(table, scattered, int(own_seed), source)
    if losses.missing > 0.0:
        order = _removal_order(table, seed, removable)
        lost |= set(order[: round(losses.missing * len(order))])
    return tuple(sorted(lost))


def _lacking_in(
    base: Scenario, stage: str, other: str, source: str
) -> frozenset[str]:
    """Returns the structures of a stage that another stage lacks.

    Args:
        base: a drive through any stage of the map.
        stage: the stage with the structures.
        other: the other stage.
        source: file and section of the losses, for error messages.

    Raises:
        InputError: a stage does not exist, or the other stage lacks nothing.
    """
    difference = _structures_of(base, stage, source) - _structures_of(
        base, other, source
    )
    if not difference:
        raise InputError(
            f"{source}: towards: stage {other} lacks nothing of stage {stage}"
        )
    return frozenset(difference)


def _structures_of(base: Scenario, stage: str, source: str) -> set[str]:
    """Returns the names of the structures in a stage.

    Args:
        base: a drive through any stage of the map.
        stage: the stage.
        source: file and section of the losses, for error messages.

    Raises:
        InputError: the stage does not exist.
    """
    scenario = base.replaced(stage=stage)
    check_files(scenario, source)
    return structures_in(load_world(scenario.world_file))


def _removal_order(
    table: Path, seed: int, removable: Set[str] | None
) -> list[str]:
    """Returns structures that can be missing, in the order of removal.

    Structures nearest to a random place are removed first.

    Args:
        table: the map's table of structures.
        seed: seed of the random place.
        removable: the structures that can be missing; None for all buildings
            and plants except those that wait on a lot for a building.

    Raises:
        InputError: no structure can be missing, or a place in the table is not
            a number.
    """
    rows = [
        row
        for _, row in read_records(table, ("name", "class"))
        if (
            row["class"] in _REMOVABLE and not _is_on_a_lot(row)
            if removable is None
            else row["name"] in removable
        )
    ]
    if not rows:
        raise InputError(f"{table}: none of its structures can be missing")
    try:
        xy = np.array([(float(row["x"]), float(row["y"])) for row in rows])
        if not (np.abs(xy) <= _FARTHEST).all():  # NaN fails, too.
            raise ValueError
    except (KeyError, ValueError):
        raise InputError(
            f"{table}: x, y: every structure needs finite numbers"
        ) from None
    rng = np.random.default_rng(seed)
    low, high = xy.min(axis=0), xy.max(axis=0)
    distance = np.linalg.norm(xy - rng.uniform(low, high), axis=1)
    return [rows[k]["name"] for k in np.argsort(distance, kind="stable")]


def _is_on_a_lot(row: Mapping[str, str]) -> bool:
    """Returns whether a structure occupies a lot only until it is built on."""
    tags = (row.get("tags") or "").split()
    return "_lot_" in row["name"] and "lot" in tags


def _scattered_losses(
    table: Path, shares: Mapping[str, float], seed: int, source: str
) -> frozenset[str]:
    """Returns a random share of the structures of each class.

    A greater share contains all structures of a smaller share.

    Args:
        table: the map's table of structures.
        shares: class -> share of its structures, from 0 to 1.
        seed: seed of the random choice.
        source: file and section of the losses, for error messages.

    Raises:
        InputError: the table has no structure of a class.
    """
    records = [row for _, row in read_records(table, ("name", "class"))]
    rows = [row for row in records if not _is_on_a_lot(row)]
    missing: set[str] = set()
    for kind, share in shares.items():
        names = sorted(row["name"] for row in rows if row["class"] == kind)
        if not names:
            raise InputError(f"{source}: scattered: no {kind!r} in {table}")
        rng = np.random.default_rng([seed, *kind.encode()])
        order = rng.permutation(len(names))
        missing.update(names[k] for k in order[: round(share * len(names))])
    return frozenset(missing)
