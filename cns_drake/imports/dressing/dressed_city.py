"""Dresses a city: adds details to its buildings and along its streets."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import shapely

from cns_drake.base.errors import InputError
from cns_drake.city.geometry import Structure
from cns_drake.imports.colours import Rgb
from cns_drake.imports.dressing.dressed_buildings import (
    DressedBuildings,
    dress_buildings,
)
from cns_drake.imports.dressing.guessed_streets import guessed_streets
from cns_drake.imports.dressing.kerbs import with_kerb
from cns_drake.imports.dressing.lane_marks import lane_marks
from cns_drake.imports.dressing.missing_sidewalks import missing_sidewalks
from cns_drake.imports.dressing.paved_gaps import paved_gaps
from cns_drake.imports.dressing.paving import near_drives
from cns_drake.imports.dressing.street_dressing import dress_streets
from cns_drake.imports.dressing.street_room import PlacedObjects
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.faces import joined_triangles
from cns_drake.imports.foreign_city import ForeignCity
from cns_drake.imports.ground import Ground, ground_structures
from cns_drake.imports.imported_objects import ImportedObject
from cns_drake.imports.staged_city import StagedCity
from cns_drake.imports.streets import Street
from cns_drake.scene.labels import MAX_INSTANCE

# Colour of paving stones.
_PAVED: Rgb = (0.57, 0.56, 0.53)
# If buildings cover at least this share of a city's area, ground of unknown
# kind is paved.
_DENSE = 0.12


@dataclass(frozen=True)
class Dressing:
    """An imported city with added details, and what was added.

    Attributes:
        city: the city with its details.
        origins: name of a changed or added structure -> `dressed` for a
            structure of the file with added details, or `lot` for a random
            structure. All other structures are as in the file.
        facts: counts of details from the file and of random details.
        guessed_ground: structures of the ground that was guessed; empty if the
            file has a terrain.
    """

    city: StagedCity
    origins: Mapping[str, str]
    facts: Mapping[str, Any]
    guessed_ground: Sequence[Structure]


def dress_city(
    staged: StagedCity,
    city: ForeignCity,
    drives: Sequence[WaypointRoute],
    ground: Ground,
    seed: int,
) -> Dressing:
    """Returns a city with details on its buildings and along its streets.

    Before the call, `city.faults` must count all small objects of the file as
    left out. The function lowers this count by the objects that it adds.

    Args:
        staged: the structures of each stage.
        city: the city as in the file.
        drives: the drives; there is more detail near drives than elsewhere.
        ground: the ground.
        seed: seed of all random draws.

    Raises:
        InputError: if there are more structures than a map may have.
    """
    always = set.intersection(*map(set, staged.standing.values()))
    is_paved = is_dense(staged.kept)
    kept = staged.kept
    streets = city.streets
    laid = _laid_paving(kept, streets, drives, ground, is_paved)
    paving = [
        one.triangles
        for one in [*kept, *laid]
        if one.is_ground or one.object_type == "Sidewalk"
    ]
    buildings = dress_buildings(
        kept, drives, streets, ground, seed, always, joined_triangles(paving)
    )
    added = [
        with_kerb(one) if one.object_type == "Sidewalk" else one for one in laid
    ]
    if drives:
        added += lane_marks(streets, drives)
    guessed_ground = ground_structures(kept, ground)
    placed = dress_streets(
        [*kept, *added],
        city.small_objects,
        streets,
        drives,
        ground,
        guessed_ground,
        seed,
    )
    _take_back_placed(city, placed)
    facts = {"seed": seed, **_facts(buildings, added, placed)}
    changed = dict(buildings.buildings)
    if is_paved:
        changed |= _paved_terrain(kept)
    if drives:
        walks = [one for one in kept if one.object_type == "Sidewalk"]
        changed |= {one: with_kerb(one) for one in near_drives(walks, drives)}
    added += placed.objects
    origins = {one.structure.name: "dressed" for one in changed.values()}
    names = {one.structure.name for one in added} - placed.from_file
    origins |= dict.fromkeys(names, "lot")
    dressed = staged.replaced({**changed, **placed.moved}).with_objects(added)
    _check_number(len(dressed.kept))
    if is_paved:
        guessed_ground = list(map(in_paving_colour, guessed_ground))
    return Dressing(dressed, origins, facts, guessed_ground)


def _facts(
    buildings: DressedBuildings,
    added: Iterable[ImportedObject],
    placed: PlacedObjects,
) -> dict[str, Any]:
    """Returns counts of details: from the file, random, and without room.

    Args:
        buildings: the dressed buildings.
        added: random objects, except small objects along streets.
        placed: the small objects along streets.
    """
    by_file = buildings.by_file + placed.by_file
    at_random = buildings.at_random + Counter(one.object_type for one in added)
    return {
        "buildings": len(buildings.buildings),
        "by_file": dict(sorted(by_file.items())),
        "at_random": dict(sorted((at_random + placed.at_random).items())),
        "without_room": placed.no_room,
    }


def _paved_terrain(
    kept: Sequence[ImportedObject],
) -> dict[ImportedObject, ImportedObject]:
    """Returns for each terrain the same terrain in the colour of paving.

    The result is empty if the file has other ground, such as roads. Without
    other ground, the file does not state what is paved, and the whole terrain
    is taken as paved.

    Args:
        kept: objects of the city.
    """
    terrain = [one for one in kept if one.object_type == "TINRelief"]
    if sum(one.is_ground for one in kept) != len(terrain):
        return {}
    return {
        one: replace(one, structure=in_paving_colour(one.structure))
        for one in terrain
    }


def _take_back_placed(city: ForeignCity, placed: PlacedObjects) -> None:
    """Removes small objects from the city's faults if they were placed."""
    # A tree row has several objects, but was left out once.
    left = set(placed.sources)
    for small in city.small_objects:
        if small.source in left:
            left.remove(small.source)
            city.faults.take_back(f"{small.element}, left out")


def _check_number(number: int) -> None:
    """Checks that there are ids for a number of structures.

    Raises:
        InputError: there are too few ids.
    """
    if number >= MAX_INSTANCE:
        raise InputError(
            f"--plain: without it the city has {number} structures,"
            f" more than instance ids can count ({MAX_INSTANCE}); or give"
            " --within"
        )


def _laid_paving(
    kept: Sequence[ImportedObject],
    streets: Sequence[Street],
    drives: Sequence[WaypointRoute],
    ground: Ground,
    is_paved: bool,
) -> list[ImportedObject]:
    """Returns carriageways and sidewalks that the file does not have.

    Args:
        kept: structures of the city.
        streets: streets of the city.
        drives: drives; without drives, nothing is laid.
        ground: the ground.
        is_paved: whether ground of unknown kind is paved.
    """
    laid: list[ImportedObject] = []
    if drives:
        laid += missing_sidewalks(kept, streets, drives)
        classes = {one.structure.semantic_class for one in kept}
        if is_paved and streets:
            laid += paved_gaps([*kept, *laid], drives)
        elif is_paved and classes.isdisjoint(("road", "sidewalk")):
            laid += guessed_streets(kept, drives, ground)
    return laid


def is_dense(objects: Sequence[ImportedObject]) -> bool:
    """Returns whether buildings cover at least 12 % of their convex hull."""
    outlines = [
        one.structure.model.footprint for one in objects if one.is_building
    ]
    if not outlines:
        return False
    whole = shapely.union_all(outlines)
    return bool(whole.area >= _DENSE * whole.convex_hull.area)


def in_paving_colour(structure: Structure) -> Structure:
    """Returns a copy of a structure in the colour of paving stones."""
    model = structure.model
    parts = tuple(replace(part, rgb=_PAVED) for part in model.parts)
    return replace(structure, model=replace(model, parts=parts))
