"""Structures that a drive's city lacks, as its field `city` says."""

from collections.abc import Mapping, Set
from pathlib import Path

import numpy as np

from cns_drake.scenarios.scenario import Scenario
from cns_drake.scene import load_world, structures_in
from evaluation.base import InputError, errors_at, poses, read_records

# Classes of structures that can be missing; streets, ground and street
# furniture always stay.
_REMOVABLE = ("building", "vegetation")


def lost_structures(scenario: Scenario) -> tuple[str, ...]:
    """Returns the names of the structures that a drive's city loses, sorted.

    Args:
        scenario: the scenario.

    Raises:
        InputError: a stage or class does not exist, or the map's table of
            structures cannot be used.
    """
    city = scenario.city
    if city.loses_nothing:
        return ()
    source = f"{scenario.source}: city"
    removable = None
    if city.towards is not None:
        removable = _lacking_in(scenario, city.towards, source)
    table = scenario.structures
    lost = _scattered_losses(table, city.shares, city.scattered_seed, source)
    if city.missing > 0.0:
        with errors_at(f"{source}.missing"):
            order = _removal_order(table, city.seed, removable)
        lost |= set(order[: round(city.missing * len(order))])
    return tuple(sorted(lost))


def _lacking_in(scenario: Scenario, other: str, source: str) -> frozenset[str]:
    """Returns the structures of a drive's stage that another stage lacks.

    Raises:
        InputError: the other stage does not exist, or lacks nothing.
    """
    here, there = (
        structures_in(load_world(world))
        for world in (scenario.world_file, scenario.folder.stage(other))
    )
    if not here - there:
        raise InputError(
            f"{source}.towards: stage {other} lacks nothing of stage"
            f" {scenario.stage}"
        )
    return frozenset(here - there)


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
        if not (np.abs(xy) <= poses.FARTHEST).all():  # NaN fails, too.
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
            raise InputError(f"{source}.scattered: no {kind!r} in {table}")
        rng = np.random.default_rng([seed, *kind.encode()])
        order = rng.permutation(len(names))
        missing.update(names[k] for k in order[: round(share * len(names))])
    return frozenset(missing)
