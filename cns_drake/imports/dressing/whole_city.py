"""Dresses a whole imported city, and records the origin of each part."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from cns_drake.base.errors import InputError
from cns_drake.city.generation.generate import MAX_STRUCTURES
from cns_drake.city.geometry.structures import Structure
from cns_drake.imports.dressing.dressed_city import dress_buildings
from cns_drake.imports.dressing.grounds import (
    guessed_streets,
    is_dense,
    lane_marks,
    missing_sidewalks,
    near_drives,
    paved,
    paved_gaps,
    with_kerb,
)
from cns_drake.imports.dressing.street_dressing import dress_streets
from cns_drake.imports.dressing.wall_panels import joined
from cns_drake.imports.drives.search import WaypointDrive
from cns_drake.imports.foreign_city import ForeignCity, Imported
from cns_drake.imports.ground import Ground, bottom_of
from cns_drake.imports.staged_city import StagedCity

_TERRAIN = "TINRelief"


@dataclass(frozen=True)
class Dressing:
    """A dressed city.

    Attributes:
        city: dressed.
        origins: name of a structure -> `dressed` or `lot`; all others are as
            the file has them.
        facts: counts of parts from the file and at random, to be written.
        bottom: the guessed ground, with its class and colour.
    """

    city: StagedCity
    origins: Mapping[str, str]
    facts: Mapping[str, Any]
    bottom: Sequence[Structure]


def _has_ground_kind(one: Imported) -> bool:
    """Returns whether the file has a ground's kind, not only its height."""
    return one.is_ground and one.kind != _TERRAIN


def _is_street(one: Imported) -> bool:
    return one.structure.semantic_class in ("road", "sidewalk")


def _laid(
    staged: StagedCity,
    city: ForeignCity,
    drives: Sequence[WaypointDrive],
    ground: Ground,
    is_paved: bool,
) -> list[Imported]:
    """Returns streets and sidewalks that the file lacks."""
    if not drives:
        return []
    laid = list(missing_sidewalks(staged.kept, city.streets, drives))
    if is_paved and city.streets:
        laid += paved_gaps([*staged.kept, *laid], drives)
    elif is_paved and not any(map(_is_street, staged.kept)):
        laid += guessed_streets(staged.kept, drives, ground)
    return laid


def dress_city(
    staged: StagedCity,
    city: ForeignCity,
    drives: Sequence[WaypointDrive],
    ground: Ground,
    seed: int,
) -> Dressing:
    """Dresses buildings and streets.

    Things that get a place are removed from the faults of the city.

    Raises:
        InputError: if there are more structures than a map may have.
    """
    always = set.intersection(*map(set, staged.standing.values()))
    is_paved = is_dense(staged.kept)
    laid = _laid(staged, city, drives, ground, is_paved)
    paving = [
        one.triangles
        for one in [*staged.kept, *laid]
        if one.is_ground or one.kind == "Sidewalk"
    ]
    buildings = dress_buildings(
        staged.kept, drives, city.streets, ground, seed, always, joined(paving)
    )
    marks = list(lane_marks(city.streets, drives)) if drives else []
    added = [with_kerb(one) if one.kind == "Sidewalk" else one for one in laid]
    added += marks
    bottom = bottom_of(staged.kept, ground)
    things = dress_streets(
        [*staged.kept, *added],
        city.things,
        city.streets,
        drives,
        ground,
        bottom,
        seed,
    )
    changed = dict(buildings.buildings)
    at_random = Counter(buildings.at_random)
    at_random += Counter(one.kind for one in added)
    if is_paved and not any(map(_has_ground_kind, staged.kept)):
        changed |= {
            one: replace(one, structure=paved(one.structure))
            for one in staged.kept
            if one.kind == _TERRAIN
        }
    if drives:
        walks = [one for one in staged.kept if one.kind == "Sidewalk"]
        changed |= {one: with_kerb(one) for one in near_drives(walks, drives)}
    added += things.structures
    for thing in city.things:
        if thing.source in things.sources:
            things.sources.remove(thing.source)
            city.faults.take_back(f"{thing.element}, left out")
    origins = {one.structure.name: "dressed" for one in changed.values()}
    from_file = things.from_file
    origins |= {
        one.structure.name: "lot"
        for one in added
        if one.structure.name not in from_file
    }
    facts = {
        "seed": seed,
        "buildings": len(buildings.buildings),
        "by_file": dict(
            sorted((Counter(buildings.by_file) + things.by_file).items())
        ),
        "at_random": dict(sorted((+at_random + things.at_random).items())),
        "without_room": things.no_room,
    }
    moved = {
        one: things.moved[one.structure.name]
        for one in staged.kept
        if one.structure.name in things.moved
    }
    dressed = staged.replaced({**changed, **moved}).joined(added)
    if len(dressed.kept) >= MAX_STRUCTURES:
        raise InputError(
            f"--plain: without it the city has {len(dressed.kept)} structures,"
            f" more than instance ids can count ({MAX_STRUCTURES}); or give"
            " --within"
        )
    if is_paved:
        bottom = list(map(paved, bottom))
    return Dressing(dressed, origins, facts, bottom)
