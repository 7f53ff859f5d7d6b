"""An additional first stage of a city, in which some buildings differ."""

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import STRtree

from worlds.imports.former_buildings import with_former_buildings
from worlds.imports.imported_objects import ImportedObject
from worlds.imports.named_randomness import random_share
from worlds.imports.staged_city import StagedCity
from worlds.shapes import MeshShape

# Buildings within this distance of each other belong to one block [m].
_BLOCK_WITHIN = 4.0
# Share of the changing buildings that is sampled block by block.
_SHARE_BY_BLOCK = 0.5
# Share of the changing buildings that is lower at first; all others are
# missing.
_SHARE_LOWER = 1.0 / 3.0
# Only buildings at least this high can be lower [m].
_LEAST_HEIGHT = 7.0
# A lower building has a share of its height within this range.
_LOWER_HEIGHTS = (0.4, 0.7)


def grow(
    city: StagedCity, part: float, seed: int
) -> tuple[StagedCity, dict[str, Any]]:
    """Returns a city with a new first stage, and how this stage differs.

    In the first stage, buildings that no longer exist today stand in place of
    the structures that replaced them. Some of the other buildings, sampled at
    random, are missing, or lower than in the last stage. Whether and how a
    building differs depends only on the seed and the building's name, and not
    on changes elsewhere in the file.

    Args:
        city: the city, with one stage.
        part: share of the buildings that differ in the first stage: they are
            missing, or lower than in the last stage.
        seed: seed of the random draws.

    Returns:
        The city with the stages 01 and 02, and a mapping: `missing` contains
        the names of missing buildings, `part_of_height` the heights of lower
        buildings as shares of their heights in the last stage, and
        `gone_since`, if there are any, the names of buildings that no longer
        exist today.
    """
    (last,) = city.standing.values()
    buildings = [one for one in last if one.is_building]
    chosen = _choose_buildings(buildings, round(part * len(buildings)), seed)
    lower = _heights_of_lower(chosen, seed)
    names = {one.structure.name for one in city.kept}
    variants = {
        building: _lowered_building(building, height, names)
        for building, height in lower.items()
    }
    absent = set(chosen) - lower.keys()
    first = [variants.get(one, one) for one in last if one not in absent]
    missing = [building.structure.name for building in absent]
    gone_since: list[ImportedObject] = []
    if city.gone:
        with_successors = first
        first = with_former_buildings(city.gone, with_successors)
        gone_since = [one for one in first if one in set(city.gone)]
        successors = set(with_successors) - set(first)
        missing += [building.draw_name for building in successors]
    changes: dict[str, Any] = {
        "missing": sorted(missing),
        "part_of_height": dict(
            sorted(
                (building.structure.name, height)
                for building, height in lower.items()
                if building.structure.name not in missing
            )
        ),
    }
    if gone_since:
        changes["gone_since"] = [one.structure.name for one in gone_since]
    in_first = set(first)
    lowered = [one for one in variants.values() if one in in_first]
    grown = replace(
        city,
        standing={"01": first, "02": last},
        kept=[*city.kept, *lowered, *gone_since],
        gone=(),
    )
    return grown, changes


def _heights_of_lower(
    chosen: Sequence[ImportedObject], seed: int
) -> dict[ImportedObject, float]:
    """Returns which buildings are lower, and their heights in the first stage.

    A height is a share of the building's height in the last stage. All other
    buildings of those `chosen` are missing in the first stage.
    """
    least, most = _LOWER_HEIGHTS
    heights = {}
    for building in chosen:
        name = building.structure.name
        if (
            np.ptp(building.triangles[:, :, 2]) >= _LEAST_HEIGHT
            and random_share(seed, "lower", name) < _SHARE_LOWER
        ):
            share = least + (most - least) * random_share(seed, "height", name)
            heights[building] = round(share, 2)
    return heights


def _choose_buildings(
    buildings: Sequence[ImportedObject], number: int, seed: int
) -> list[ImportedObject]:
    """Returns `number` random buildings, about half of them block by block."""
    blocks: dict[int, list[ImportedObject]] = {}
    numbers = _block_numbers(buildings)
    for number_of_block, building in zip(numbers, buildings, strict=True):
        blocks.setdefault(number_of_block, []).append(building)

    def lot_of_block(members: list[ImportedObject]) -> float:
        name = min(member.structure.name for member in members)
        return random_share(seed, "block", name)

    chosen: list[ImportedObject] = []
    for members in sorted(blocks.values(), key=lot_of_block):
        if len(chosen) >= _SHARE_BY_BLOCK * number:
            break
        if 1 < len(members) <= number - len(chosen):
            chosen += members
    singles = sorted(
        set(buildings) - set(chosen),
        key=lambda one: random_share(seed, "single", one.structure.name),
    )
    return chosen + singles[: number - len(chosen)]


def _block_numbers(buildings: Sequence[ImportedObject]) -> np.ndarray:
    """Returns for each building the number (N,) of its block."""
    if not buildings:
        return np.zeros(0, dtype=int)
    outlines = [building.structure.model.footprint for building in buildings]
    near = STRtree(outlines).query(np.array(outlines), "dwithin", _BLOCK_WITHIN)
    links = coo_array(
        (np.ones(near.shape[1]), (near[0], near[1])),
        (len(outlines), len(outlines)),
    )
    _, block = connected_components(links, directed=False)
    return np.asarray(block)


def _lowered_building(
    building: ImportedObject, share: float, taken: AbstractSet[str]
) -> ImportedObject:
    """Returns a building scaled to a share of its height, with a new name.

    `taken` contains names that other structures have.
    """
    suffix = "_lower"
    while f"{building.structure.name}{suffix}" in taken:
        suffix += "_"
    foot = float(building.foot[2])
    scale = np.array([1.0, 1.0, share])
    move = np.array([0.0, 0.0, (1.0 - share) * foot])
    model = building.structure.model
    meshes = {
        f"{name}{suffix}": replace(mesh, vertices=mesh.vertices * scale + move)
        for name, mesh in model.meshes.items()
    }
    parts = tuple(
        replace(
            part, shape=replace(part.shape, mesh=f"{part.shape.mesh}{suffix}")
        )
        if isinstance(part.shape, MeshShape)
        else part
        for part in model.parts
    )
    structure = replace(
        building.structure,
        name=f"{building.structure.name}{suffix}",
        model=replace(model, parts=parts, meshes=meshes),
    )
    return replace(
        building,
        structure=structure,
        object_type=f"{building.object_type}, lower at first",
        triangles=building.triangles * scale + move,
        original=building.structure.name,
    )
