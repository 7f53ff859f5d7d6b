"""Draws a first stage, with fewer buildings, for a city without years."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import STRtree

from cns_drake.city.geometry.structures import MeshShape
from cns_drake.imports.foreign_city import Imported
from cns_drake.imports.gone_buildings import with_gone
from cns_drake.imports.lots import lot
from cns_drake.imports.staged_city import StagedCity

# Buildings this near to each other are of one block [m].
_SAME_BLOCK = 4.0
# The part of the changing buildings that is drawn block by block, and the part
# that is lower at first; the others are missing.
_BY_BLOCK = 0.5
_LOWER = 1.0 / 3.0
# Only buildings at least this high [m] can be lower, with this part of their
# height.
_LEAST_HEIGHT = 7.0
_HEIGHTS = (0.4, 0.7)


@dataclass(frozen=True)
class Growth:
    """The drawn changes.

    Attributes:
        missing: buildings that the first stage lacks.
        lower: building -> its height there as a part of the whole.
        gone: buildings of the file that stood there and stand no more.
    """

    missing: tuple[str, ...]
    lower: dict[str, float]
    gone: tuple[str, ...] = ()


def grow(city: StagedCity, part: float, seed: int) -> tuple[StagedCity, Growth]:
    """Returns a city with a stage before its only one.

    The draws depend on the names of buildings, so that the rest of a file does
    not change them.

    Args:
        city: of one stage; what is gone by then stands at the first, and what
            has its place today does not.
        part: share of its buildings that are missing or lower at first.
        seed: of the lot.
    """
    (last,) = city.standing.values()
    buildings = [one for one in last if one.kind.startswith("Building")]
    chosen = _drawn(buildings, round(part * len(buildings)), seed)
    taken = {one.structure.name for one in city.kept}
    missing: list[str] = []
    lower: dict[str, float] = {}
    variants: dict[Imported, Imported | None] = {}
    for one in chosen:
        name = one.structure.name
        z = one.triangles[:, :, 2]
        if np.ptp(z) >= _LEAST_HEIGHT and lot(seed, "lower", name) < _LOWER:
            low, high = _HEIGHTS
            share = low + (high - low) * lot(seed, "height", name)
            lower[name] = round(share, 2)
            variants[one] = _lowered(one, lower[name], taken)
        else:
            missing.append(name)
            variants[one] = None
    first = [new for one in last if (new := variants.get(one, one)) is not None]
    extra = [new for new in variants.values() if new is not None]
    stood: list[Imported] = []
    if city.gone:
        before = first
        first = with_gone(city.gone, before)
        stood = [one for one in first if one in set(city.gone)]
        replaced = set(before) - set(first)
        missing += [one.lot_name for one in replaced]
        extra = [one for one in extra if one not in replaced]
        lower = {n: h for n, h in lower.items() if n not in missing}
    grown = replace(
        city,
        standing={"01": first, "02": last},
        kept=[*city.kept, *extra, *stood],
        gone=(),
    )
    return grown, Growth(
        tuple(sorted(missing)),
        dict(sorted(lower.items())),
        tuple(one.structure.name for one in stood),
    )


def _drawn(
    buildings: Sequence[Imported], number: int, seed: int
) -> list[Imported]:
    """Returns a number of buildings, about half of them block by block."""
    blocks: dict[int, list[Imported]] = {}
    for block, one in zip(_blocks(buildings), buildings, strict=True):
        blocks.setdefault(block, []).append(one)

    def lot_of_block(members: list[Imported]) -> float:
        name = min(one.structure.name for one in members)
        return lot(seed, "block", name)

    chosen: list[Imported] = []
    for members in sorted(blocks.values(), key=lot_of_block):
        if len(chosen) >= _BY_BLOCK * number:
            break
        if 1 < len(members) <= number - len(chosen):
            chosen += members
    left = set(buildings) - set(chosen)
    singles = sorted(
        left, key=lambda one: lot(seed, "single", one.structure.name)
    )
    return chosen + singles[: number - len(chosen)]


def _blocks(buildings: Sequence[Imported]) -> np.ndarray:
    """Returns the number of the block (N,) of each building."""
    if not buildings:
        return np.zeros(0, dtype=int)
    outlines = [one.structure.model.footprint for one in buildings]
    near = STRtree(outlines).query(np.array(outlines), "dwithin", _SAME_BLOCK)
    links = coo_array(
        (np.ones(near.shape[1]), (near[0], near[1])),
        (len(outlines), len(outlines)),
    )
    _, block = connected_components(links, directed=False)
    return np.asarray(block)


def _lowered(one: Imported, share: float, taken: set[str]) -> Imported:
    """Returns a building cut to a part of its height, under a new name."""
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
        kind=f"{one.kind}, lower at first",
        triangles=one.triangles * scale + move,
        original=one.structure.name,
    )
