"""The structures of an imported city in each stage."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
import shapely
from shapely import STRtree
from shapely.geometry import MultiLineString
from shapely.geometry.base import BaseGeometry

from cns_drake.base.errors import InputError
from cns_drake.city.geometry import Mesh, MeshShape
from cns_drake.imports.building_years import stands_today
from cns_drake.imports.drives.search import WaypointRoute
from cns_drake.imports.foreign_city import (
    ForeignCity,
    Imported,
    boxes_of,
    random_share,
)
from cns_drake.imports.options import ImportFaults, ImportOptions
from cns_drake.scene.labels import MAX_INSTANCE

# Two buildings stand in the same place if they share this much of the smaller
# outline.
_SHARED = 0.3
# Greatest distance of a structure from the middle of a city [m].
_FARTHEST = 10_000.0
# Buildings within this distance of each other belong to one block [m].
_SAME_BLOCK = 4.0
# Share of the changing buildings that is sampled block by block.
_BY_BLOCK = 0.5
# Share of the changing buildings that is lower at first; all others are
# missing.
_LOWER = 1.0 / 3.0
# Only buildings at least this high can be lower [m].
_LEAST_HEIGHT = 7.0
# A lower building has a share of its height within this range.
_HEIGHTS = (0.4, 0.7)


def _are_near(
    things: np.ndarray, ways: BaseGeometry, distance: float
) -> np.ndarray:
    """Returns (M,) which things have a bounding box near the ways.

    `things` has the N corners of each, (M, N, 3) [m].
    """
    low, high = things[:, :, :2].min(axis=1), things[:, :, :2].max(axis=1)
    boxes = shapely.box(*low.T, *high.T)
    return np.asarray(shapely.dwithin(boxes, ways, distance))


def _crop_terrain(
    one: Imported, ways: BaseGeometry, distance: float
) -> Imported:
    """Returns the part of a terrain near the ways, otherwise unchanged."""
    meshes = {}
    for name, mesh in one.structure.model.meshes.items():
        faces = mesh.triangles()
        near = faces[_are_near(mesh.vertices[faces], ways, distance)]
        used, index = np.unique(near, return_inverse=True)
        corners = map(tuple, index.reshape(-1, 3).tolist())
        meshes[name] = Mesh(mesh.vertices[used], tuple(corners))
    model = one.structure.model
    parts = tuple(
        part
        for part in model.parts
        if isinstance(part.shape, MeshShape) and meshes[part.shape.mesh].faces
    )
    filled = {name: mesh for name, mesh in meshes.items() if mesh.faces}
    structure = replace(
        one.structure, model=replace(model, parts=parts, meshes=filled)
    )
    near = _are_near(one.triangles, ways, distance)
    return replace(one, structure=structure, triangles=one.triangles[near])


def with_gone(
    gone: Sequence[Imported], others: Iterable[Imported]
) -> list[Imported]:
    """Returns the structures of a past city: `others`, and former buildings.

    Where a building of today stands in the place of a former building, the
    result contains only one of the two: the building of today if its year of
    construction is known, and otherwise the former building.

    Args:
        gone: the former buildings, demolished at an unknown date.
        others: structures of today, which stood in the past city as well.
    """
    others = list(others)
    later = [one for one in others if one.kind.startswith("Building")]
    tree = STRtree([one.structure.model.footprint for one in later])
    stood: list[Imported] = []
    replaced: set[Imported] = set()
    for one in gone:
        outline = one.structure.model.footprint
        there = [
            later[k]
            for k in np.sort(tree.query(outline, "intersects"))
            if _shares(outline, later[k].structure.model.footprint)
        ]
        if any(new.year is not None for new in there):
            continue
        stood.append(one)
        replaced.update(there)
    return [one for one in others if one not in replaced] + stood


def _shares(one: BaseGeometry, other: BaseGeometry) -> bool:
    shared = one.intersection(other).area
    return bool(shared > _SHARED * min(one.area, other.area))


@dataclass(frozen=True)
class StagedCity:
    """The structures of an imported city, by stage.

    Attributes:
        standing: name of a stage -> structures that exist in this stage.
        kept: structures that exist in at least one stage.
        undated: number of buildings without a year.
        dated: number of buildings with a year.
        gone: buildings that no longer exist, for `grow`; empty if the options
            of the import do not include `grow`.
    """

    standing: dict[str, list[Imported]]
    kept: list[Imported]
    undated: int
    dated: int
    gone: Sequence[Imported] = ()

    def near(
        self,
        drives: Sequence[WaypointRoute],
        distance: float,
        faults: ImportFaults,
    ) -> StagedCity:
        """Returns the city without structures far from drives.

        A structure is kept if its bounding box is within `distance` [m] of a
        drive; all other structures are counted in `faults`. Terrain is cut to
        the part near the drives.

        Raises:
            InputError: if no structure is near a drive, or there is no drive.
        """
        if not drives:
            raise InputError(
                "--within: no drive was found; give one with --along"
            )
        ways = MultiLineString([drive.path for drive in drives])
        shapely.prepare(ways)
        cut: dict[Imported, Imported | None] = {}
        for one in self.kept:
            corners = one.triangles.reshape(-1, 3)
            if not _are_near(corners[None], ways, distance)[0]:
                name = one.structure.name
                faults.add("structure far from the drives, left out", name)
                cut[one] = None
            elif one.kind == "TINRelief":
                cut[one] = _crop_terrain(one, ways, distance)
        near = self.replaced(cut)
        if not near.kept:
            raise InputError(
                f"--within: nothing stands within {distance:g} m of the drives"
            )
        return near

    def replaced(
        self, changed: Mapping[Imported, Imported | None]
    ) -> StagedCity:
        """Returns the city with some structures replaced or removed.

        `changed` maps a structure to its replacement, or to None to remove it.
        """

        def new(some: Iterable[Imported]) -> list[Imported]:
            others = (changed.get(one, one) for one in some)
            return [one for one in others if one is not None]

        standing = {stage: new(some) for stage, some in self.standing.items()}
        return replace(self, standing=standing, kept=new(self.kept))

    def joined(self, added: Sequence[Imported]) -> StagedCity:
        """Returns the city with more structures, which exist in all stages."""
        standing = {
            stage: [*some, *added] for stage, some in self.standing.items()
        }
        return replace(self, standing=standing, kept=[*self.kept, *added])


def stage_city(
    source: object, city: ForeignCity, options: ImportOptions
) -> StagedCity:
    """Assigns the structures of an imported city to the stages of a map.

    Structures that exist in no stage are counted in `city.faults`.

    Args:
        source: the imported file, named in error messages.
        city: the city as in its file.
        options: options of the import, such as the years of the stages.

    Raises:
        InputError: if all stages together have no structure, or too many.
    """
    found = _without_outliers(city)
    if not found:
        raise InputError(f"{source}: no object has a surface")
    standing = {
        stage: [
            one
            for one in found
            if not _has_years(one) or _stands(one, k, options)
        ]
        for k, stage in enumerate(stage_names(options.years))
    }
    gone: list[Imported] = []
    if options.grow is not None:
        (today,) = map(set, standing.values())
        gone = [one for one in found if one not in today]
    elif options.dressed:
        standing = {
            stage: with_gone(
                [one for one in some if not _is_here(one)],
                [one for one in some if _is_here(one)],
            )
            for stage, some in standing.items()
        }
    ever = {one for some in standing.values() for one in some}
    for one in found:
        if one not in ever and one not in gone:
            kind = f"building {_why_never(one, options)}, left out"
            city.faults.add(kind, one.structure.name)
    kept = [one for one in found if one in ever]
    if len(kept) >= MAX_INSTANCE:
        raise InputError(
            f"{source}: {len(kept)} objects are more than instance ids can"
            f" count ({MAX_INSTANCE})"
        )
    if not kept:
        raise InputError(
            f"{source}: no structure stands at any stage; check --years and "
            "--undated"
        )
    years = [one.year for one in found if _has_years(one)]
    undated = years.count(None)
    return StagedCity(standing, kept, undated, len(years) - undated, gone)


def _is_here(one: Imported) -> bool:
    """Returns whether a structure, once built, still stands today."""
    return not one.is_gone and stands_today(one.until)


def _stands(one: Imported, stage: int, options: ImportOptions) -> bool:
    """Returns whether a structure stands at a stage, given by its number.

    A structure that was demolished at an unknown date stands at all stages
    except the last, if its year (or its missing year) allows it.
    """
    years = options.years
    until = one.until
    if one.is_gone:
        years = years[:-1]
        until = None
        if stage >= len(years):
            return False
    if not years:
        return stands_today(until)
    if until is not None and years[stage] >= until:
        return False
    if one.year is not None:
        return one.year <= years[stage]
    if options.undated == "first":
        return True
    return options.undated == "last" and stage == len(years) - 1


def stage_names(years: Sequence[int]) -> list[str]:
    """Returns the names of the stages: a number from 01 for each year.

    Without years there is one stage, 01.

    Raises:
        InputError: if years do not increase.
    """
    if any(a >= b for a, b in pairwise(years)):
        listed = " ".join(map(str, years))
        raise InputError(
            f"--years: {listed}: each year must be after the one before"
        )
    return [f"{number:02d}" for number in range(1, max(len(years), 1) + 1)]


def _without_outliers(city: ForeignCity) -> list[Imported]:
    """Returns the structures of a city without those far from its middle."""
    if not city.structures:
        return []
    boxes = boxes_of(city.structures)
    middle = np.median(boxes.mean(axis=1), axis=0)
    kept = []
    for one, reach in zip(
        city.structures, np.abs(boxes - middle).max(axis=(1, 2)), strict=True
    ):
        if reach <= _FARTHEST:
            kept.append(one)
        else:
            kind = f"object more than {_FARTHEST / 1000:g} km away, left out"
            city.faults.add(kind, one.structure.name)
    return kept


def _why_never(one: Imported, options: ImportOptions) -> str:
    """Returns why a building stands at no stage, in words."""
    first = options.years[0] if options.years else None
    if one.until is not None and (first is None or one.until <= first):
        return "demolished before the first stage" if first else "demolished"
    if one.is_gone and len(options.years) < 2:
        return "demolished"
    if one.year is None:
        return "without a year"
    if options.years and one.year > options.years[-1]:
        return "built after the last stage"
    return "that stood between stages"


def _has_years(one: Imported) -> bool:
    """Returns whether a structure may be missing at some stages.

    Of the structures without a year, only buildings may.
    """
    is_building = one.kind.startswith("Building")
    is_dated = one.year is not None or one.until is not None
    return not one.is_ground and (is_dated or is_building)


def grow(
    city: StagedCity, part: float, seed: int
) -> tuple[StagedCity, dict[str, Any]]:
    """Returns a city with an additional first stage, and its differences.

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
    buildings = [one for one in last if one.kind.startswith("Building")]
    chosen = _choose_buildings(buildings, round(part * len(buildings)), seed)
    taken = {one.structure.name for one in city.kept}
    missing: list[str] = []
    lower: dict[str, float] = {}
    variants: dict[Imported, Imported | None] = {}
    for one in chosen:
        name = one.structure.name
        z = one.triangles[:, :, 2]
        if (
            np.ptp(z) >= _LEAST_HEIGHT
            and random_share(seed, "lower", name) < _LOWER
        ):
            low, high = _HEIGHTS
            share = low + (high - low) * random_share(seed, "height", name)
            lower[name] = round(share, 2)
            variants[one] = _lowered_building(one, lower[name], taken)
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
        missing += [one.draw_name for one in replaced]
        extra = [one for one in extra if one not in replaced]
        lower = {n: h for n, h in lower.items() if n not in missing}
    grown = replace(
        city,
        standing={"01": first, "02": last},
        kept=[*city.kept, *extra, *stood],
        gone=(),
    )
    changes: dict[str, Any] = {
        "missing": sorted(missing),
        "part_of_height": dict(sorted(lower.items())),
    }
    if stood:
        changes["gone_since"] = [one.structure.name for one in stood]
    return grown, changes


def _choose_buildings(
    buildings: Sequence[Imported], number: int, seed: int
) -> list[Imported]:
    """Returns `number` random buildings, about half of them block by block."""
    blocks: dict[int, list[Imported]] = {}
    for block, one in zip(_block_numbers(buildings), buildings, strict=True):
        blocks.setdefault(block, []).append(one)

    def lot_of_block(members: list[Imported]) -> float:
        name = min(one.structure.name for one in members)
        return random_share(seed, "block", name)

    chosen: list[Imported] = []
    for members in sorted(blocks.values(), key=lot_of_block):
        if len(chosen) >= _BY_BLOCK * number:
            break
        if 1 < len(members) <= number - len(chosen):
            chosen += members
    left = set(buildings) - set(chosen)
    singles = sorted(
        left, key=lambda one: random_share(seed, "single", one.structure.name)
    )
    return chosen + singles[: number - len(chosen)]


def _block_numbers(buildings: Sequence[Imported]) -> np.ndarray:
    """Returns (N,) the number of the block to which each building belongs."""
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


def _lowered_building(one: Imported, share: float, taken: set[str]) -> Imported:
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
        kind=f"{one.kind}, lower at first",
        triangles=one.triangles * scale + move,
        original=one.structure.name,
    )
