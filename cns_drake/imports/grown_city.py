"""An additional first stage of a city, in which some buildings differ."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import STRtree

from cns_drake.city.geometry import MeshShape
from cns_drake.imports.former_buildings import with_former_buildings
from cns_drake.imports.imported_objects import ImportedObject
from cns_drake.imports.named_randomness import random_share
from cns_drake.imports.staged_city import StagedCity

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
    taken = {one.structure.name for one in city.kept}
    lower = _heights_of_lower(chosen, seed)
    variants = {
        one: _lowered_building(one, lower[one], taken) if one in lower else None
        for one in chosen
    }
    first = [new for one in last if (new := variants.get(one, one)) is not None]
    missing = [one.structure.name for one in chosen if one not in lower]
    stood: list[ImportedObject] = []
    if city.gone:
        before = first
        first = with_former_buildings(city.gone, before)
        stood = [one for one in first if one in set(city.gone)]
        missing += [one.draw_name for one in set(before) - set(first)]
    extra = [new for new in variants.values() if new in set(first)]
    changes: dict[str, Any] = {
        "missing": sorted(missing),
        "part_of_height": dict(
            sorted(
                (one.structure.name, height)
                for one, height in lower.items()
                if one.structure.name not in missing
            )
        ),
    }
    if stood:
        changes["gone_since"] = [one.structure.name for one in stood]
    grown = replace(
        city,
        standing={"01": first, "02": last},
        kept=[*city.kept, *extra, *stood],
        gone=(),
    )
    return grown, changes


def _heights_of_lower(
    chosen: Sequence[ImportedObject], seed: int
) -> dict[ImportedObject, float]:
    """Returns for each lower building the share of the height that remains."""
    least, most = _LOWER_HEIGHTS
    heights = {}
    for one in chosen:
        name = one.structure.name
        if (
            np.ptp(one.triangles[:, :, 2]) >= _LEAST_HEIGHT
            and random_share(seed, "lower", name) < _SHARE_LOWER
        ):
            share = least + (most - least) * random_share(seed, "height", name)
            heights[one] = round(share, 2)
    return heights


def _choose_buildings(
    buildings: Sequence[ImportedObject], number: int, seed: int
) -> list[ImportedObject]:
    """Returns `number` random buildings, about half of them block by block."""
    blocks: dict[int, list[ImportedObject]] = {}
    for block, one in zip(_block_numbers(buildings), buildings, strict=True):
        blocks.setdefault(block, []).append(one)

    def lot_of_block(members: list[ImportedObject]) -> float:
        name = min(one.structure.name for one in members)
        return random_share(seed, "block", name)

    chosen: list[ImportedObject] = []
    for members in sorted(blocks.values(), key=lot_of_block):
        if len(chosen) >= _SHARE_BY_BLOCK * number:
            break
        if 1 < len(members) <= number - len(chosen):
            chosen += members
    left = set(buildings) - set(chosen)
    singles = sorted(
        left, key=lambda one: random_share(seed, "single", one.structure.name)
    )
    return chosen + singles[: number - len(chosen)]


def _block_numbers(buildings: Sequence[ImportedObject]) -> np.ndarray:
    """Returns for each building the number (N,) of its block."""
    if not buildings:
        return np.zeros(0, dtype=int)
    outlines = [one.structure.model.footprint for one in buildings]
    near = STRtree(outlines).query(np.array(outlines), "dwithin", _BLOCK_WITHIN)
    links = coo_array(
        (np.ones(near.shape[1]), (near[0], near[1])),
        (len(outlines), len(outlines)),
    )
    _, block = connected_components(links, directed=False)
    return np.asarray(block)


def _lowered_building(
    one: ImportedObject, share: float, taken: set[str]
) -> ImportedObject:
    """Returns a building cut to a share of its height, with a new name."""
    suffix = "_lower"
    while f"{one.structure.name}{suffix}" in taken:
        suffix += "_"
    bottom = float(one.triangles[:, :, 2].min())
    scale = np.array([1.0, 1.0, share])
    move = np.array([0.0, 0.0, (1.0 - share) * bottom])
    model = one.structure.model
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
        one.structure,
        name=f"{one.structure.name}{suffix}",
        model=replace(model, parts=parts, meshes=meshes),
    )
    return replace(
        one,
        structure=structure,
        object_type=f"{one.object_type}, lower at first",
        triangles=one.triangles * scale + move,
        original=one.structure.name,
    )
