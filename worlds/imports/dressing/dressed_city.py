"""Dresses a city: adds details to its buildings and along its streets."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry import LineString, MultiLineString
from shapely.geometry.base import BaseGeometry

from evaluation.base import MAX_INSTANCE, InputError
from worlds.city import DASH, DASH_GAP
from worlds.imports.colours import WHITE_PAINT, Rgb
from worlds.imports.dressing.dressed_buildings import (
    DressedBuildings,
    dress_buildings,
)
from worlds.imports.dressing.guessed_streets import guessed_streets
from worlds.imports.dressing.paving import (
    PAVED_WITHIN,
    area_outside,
    near_drives,
    paved_structure,
    polygons_only,
    triangles_from_above,
)
from worlds.imports.dressing.street_dressing import dress_streets
from worlds.imports.dressing.street_room import PlacedObjects
from worlds.imports.drives.steerable_drives import WaypointRoute
from worlds.imports.faces import flat_surface, joined_triangles, parts_of
from worlds.imports.faults import ImportFaults
from worlds.imports.foreign_city import ForeignCity
from worlds.imports.ground import Ground, ground_structures
from worlds.imports.imported_objects import Base, ImportedObject, make_object
from worlds.imports.staged_city import StagedCity
from worlds.imports.streets import (
    KERB_HEIGHT,
    SIDEWALK_WIDTH,
    Street,
    ends_at_nodes,
)
from worlds.shapes import GRID, Mesh, MeshShape, Part, Structure, turned_up

# Colour of paving stones.
_PAVED: Rgb = (0.57, 0.56, 0.53)
# If buildings cover at least this share of a city's area, ground of unknown
# kind is paved.
_DENSE = 0.12
# The sides of a kerb reach this far down from its upper edges [m].
_KERB_DEPTH = 0.25
# Colour of kerbs.
_KERB_RGB: Rgb = (0.60, 0.60, 0.58)
# Millimetres in a metre: corners that are equal in whole millimetres are one.
_MM = 1000.0
# Streets get marks if they are this close to drives [m].
_MARKS_WITHIN = 80.0
# Streets get marks if they are at least this wide [m].
_LEAST_MARKED = 6.0
# Streets of these kinds get marks, as do streets with two lanes.
_MARKED_KINDS = ("primary", "secondary", "tertiary")
# Width of a dash [m].
_DASH_WIDTH = 0.12
# Height of a dash above the street [m].
_DASH_HEIGHT = 0.01
# Length before a junction that stays free, in addition to half the street's
# width [m].
_BEFORE_JUNCTION = 4.0
# Pieces of a sidewalk are left out if no circle of this radius fits in [m].
_SLIVER_RADIUS = 0.3
# Streets of these kinds have sidewalks unless their tags say otherwise.
_WITH_SIDEWALKS = (
    "primary",
    "secondary",
    "tertiary",
    "unclassified",
    "residential",
)
# Width of the widest gap that is paved [m].
_WIDEST_GAP = 3.0
# Area of the smallest gap that is paved [m^2].
_SMALLEST_GAP = 0.05
# Parts of a gap that are narrower than this stay open [m].
_NARROWEST_GAP = 0.1
# A gap is at most this far from a sidewalk [m].
_GAP_WITHIN = 0.1
# All gaps in a square of this size are one structure [m].
_SQUARE = 50.0


@dataclass(frozen=True)
class Dressing:
    """An imported city with added details, and what was added.

    Attributes:
        city: the city with its details.
        origins: name of a changed or added structure -> `dressed` for a
            structure of the file with added details, or `lot` for a random
            structure. All other structures are as in the file.
        facts: counts of details from the file and of random details.
        sources: ids, in the file, of the small objects that were placed.
        guessed_ground: structures of the ground that was guessed; empty if the
            file has a terrain.
    """

    city: StagedCity
    origins: Mapping[str, str]
    facts: Mapping[str, Any]
    sources: Set[str]
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
    paving = [one.triangles for one in [*kept, *laid] if one.is_paving]
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
    number = len(dressed.kept)
    if number >= MAX_INSTANCE:
        raise InputError(
            f"--plain: without it the city has {number} structures,"
            f" more than instance ids can count ({MAX_INSTANCE}); or give"
            " --within"
        )
    if is_paved:
        guessed_ground = list(map(in_paving_colour, guessed_ground))
    return Dressing(dressed, origins, facts, placed.sources, guessed_ground)


def _facts(
    buildings: DressedBuildings,
    added: Iterable[ImportedObject],
    placed: PlacedObjects,
) -> dict[str, Any]:
    """Returns counts of details: from the file, random, and without room.

    Args:
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


def with_kerb(sidewalk: ImportedObject) -> ImportedObject:
    """Returns a sidewalk with a kerb: a vertical face along its whole edge."""
    structure = sidewalk.structure
    name = f"{structure.name}_kerb"
    edges = _outer_edges(turned_up(sidewalk.triangles))
    if not len(edges):
        return sidewalk
    low = edges - [0.0, 0.0, _KERB_DEPTH]
    quads = np.stack([low[:, 0], low[:, 1], edges[:, 1], edges[:, 0]], axis=1)
    corners = np.arange(4 * len(quads)).reshape(-1, 4).tolist()
    mesh = Mesh(quads.reshape(-1, 3), tuple(map(tuple, corners)))
    model = replace(
        structure.model,
        parts=(
            *structure.model.parts,
            Part("kerb", MeshShape(name), rgb=_KERB_RGB, material="kerb"),
        ),
        meshes={**structure.model.meshes, name: mesh},
    )
    return replace(sidewalk, structure=replace(structure, model=model))


def _outer_edges(triangles: np.ndarray) -> np.ndarray:
    """Returns the edges (N, 2, 3) that no two triangles (M, 3, 3) share."""
    corners = np.rint(triangles.reshape(-1, 3) * _MM).astype(np.int64)
    _, number = np.unique(corners, axis=0, return_inverse=True)
    number = number.reshape(-1, 3)
    edges = np.stack([number, np.roll(number, -1, axis=1)], axis=2)
    places = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
    _, index, counts = np.unique(
        np.sort(edges.reshape(-1, 2), axis=1),
        axis=0,
        return_inverse=True,
        return_counts=True,
    )
    return np.asarray(places.reshape(-1, 2, 3)[counts[index.reshape(-1)] == 1])


def lane_marks(
    streets: Sequence[Street], drives: Sequence[WaypointRoute]
) -> Iterator[ImportedObject]:
    """Yields dashed lines in the middle of the larger streets near drives.

    There must be at least one drive, and the ground must be level.
    """
    paths = MultiLineString([drive.path for drive in drives])
    junctions = _junctions(streets)
    for street in streets:
        line = LineString(street.line)
        lanes = street.tags.get("lanes", "1")
        if (
            street.forward
            and street.backward
            and street.width >= _LEAST_MARKED
            and (street.tags.get("highway") in _MARKED_KINDS or lanes == "2")
            and line.distance(paths) < _MARKS_WITHIN
        ):
            middles = np.arange(DASH_GAP, line.length - DASH, DASH + DASH_GAP)
            places = shapely.line_interpolate_point(line, middles)
            free = street.width / 2.0 + _BEFORE_JUNCTION
            # Without any junction, the distance is NaN.
            kept = ~(shapely.distance(places, junctions) <= free)
            dashes = [_dash(line, s) for s in middles[kept].tolist()]
            if dashes:
                yield make_object(
                    f"marks_{street.name}",
                    "road",
                    "Lane mark",
                    {"paint": np.concatenate(dashes)},
                    {"paint": WHITE_PAINT},
                )


def _junctions(streets: Sequence[Street]) -> shapely.MultiPoint:
    """Returns the places where more than two street ends meet."""
    ends = ends_at_nodes(streets)
    places = {
        node: place
        for street in streets
        for node, place in zip(street.nodes, street.line, strict=True)
    }
    return shapely.MultiPoint([places[n] for n in ends if ends[n] > 2])


def _dash(line: LineString, s: float) -> np.ndarray:
    """Returns a dash at arc length `s` of a line: triangles (2, 3, 3) [m]."""
    ends = [line.interpolate(s + k * DASH / 2.0) for k in (-1.0, 1.0)]
    a, b = (np.array([end.x, end.y]) for end in ends)
    along = (b - a) / np.hypot(*(b - a))
    left = np.array([-along[1], along[0]]) * _DASH_WIDTH / 2.0
    ring = np.array([a - left, b - left, b + left, a + left])
    corners = np.column_stack([ring, np.full(4, _DASH_HEIGHT)])
    return corners[[[0, 1, 2], [0, 2, 3]]]


def missing_sidewalks(
    objects: Sequence[ImportedObject],
    streets: Sequence[Street],
    drives: Sequence[WaypointRoute],
) -> Iterator[ImportedObject]:
    """Yields sidewalks for streets whose tags do not mention sidewalks.

    Only the larger streets within 80 m of a drive get sidewalks. The ground
    must be level.

    Args:
        objects: objects of the city, which the sidewalks must not overlap.
        streets: the streets.
        drives: the drives, at least one.
    """
    paths = MultiLineString([drive.path for drive in drives])
    near = [
        (street, LineString(street.line))
        for street in streets
        if LineString(street.line).distance(paths) < PAVED_WITHIN
    ]
    lacking = [
        (street, line)
        for street, line in near
        if street.tags.get("highway") in _WITH_SIDEWALKS
        and not any(key.startswith("sidewalk") for key in street.tags)
    ]
    if not lacking:
        return
    carriageways = [
        line.buffer(street.width / 2.0, quad_segs=4) for street, line in near
    ]
    standing = [one for one in objects if one.base is Base.GROUND]
    obstacles = _obstacles(near_drives(standing, drives))
    taken = np.concatenate([obstacles, carriageways])
    # The union of a whole city takes long, so only polygons near each street
    # are used.
    tree = STRtree(taken)
    sidewalks: list[BaseGeometry] = []
    for street, line in lacking:
        reach = street.width / 2.0 + SIDEWALK_WIDTH
        strip = line.buffer(reach, quad_segs=4)
        others = [
            *taken[tree.query(strip, "intersects")],
            *(area for area in sidewalks if area.intersects(strip)),
        ]
        covered = shapely.union_all(others, grid_size=GRID)
        sidewalk = area_outside(strip, covered)
        sidewalks.append(sidewalk)
        surface = [
            flat_surface(part, KERB_HEIGHT, street.name, ImportFaults())
            for part in parts_of(sidewalk)
            if not part.buffer(-_SLIVER_RADIUS).is_empty
        ]
        if surface:
            laid = np.concatenate(surface)
            yield paved_structure(f"sidewalk_{street.name}", "sidewalk", laid)


def _obstacles(objects: Iterable[ImportedObject]) -> np.ndarray:
    """Returns the areas (N,) that no sidewalk may cover, in W [m]."""
    return triangles_from_above(
        [
            one
            for one in objects
            if one.structure.semantic_class in ("building", "road", "sidewalk")
            or one.object_type.startswith("Water")
        ]
    )


def paved_gaps(
    objects: Sequence[ImportedObject], drives: Sequence[WaypointRoute]
) -> Iterator[ImportedObject]:
    """Yields sidewalks that fill gaps beside existing sidewalks.

    A gap is unpaved ground at most 3 m wide, such as the strip between a
    sidewalk and a building. Only gaps near the drives are filled. The ground
    must be level.
    """
    near = near_drives(
        [
            one
            for one in objects
            if one.base is Base.GROUND and one.object_type != "Tree"
        ],
        drives,
    )
    walks = [
        _flat_outline(imported)
        for imported in near
        if imported.object_type == "Sidewalk"
    ]
    if not walks:
        return
    walks_tree = STRtree(walks)
    gaps = _gaps_beside(walks, walks_tree, near)
    obstacles = triangles_from_above(
        [
            imported
            for imported in near
            if imported.object_type not in ("Sidewalk", "Road", "Crossing")
            and imported.structure.semantic_class != "building"
        ]
    )
    obstacles_tree = STRtree(obstacles)
    surfaces: dict[tuple[int, int], list[np.ndarray]] = {}
    for gap in parts_of(gaps):
        if (
            gap.area < _SMALLEST_GAP
            or not walks_tree.query(gap, "dwithin", _GAP_WITHIN).size
        ):
            continue
        taken = shapely.union_all(
            obstacles[obstacles_tree.query(gap, "intersects")], grid_size=GRID
        )
        square = (
            int(gap.centroid.x // _SQUARE),
            int(gap.centroid.y // _SQUARE),
        )
        surfaces.setdefault(square, []).extend(
            flat_surface(part, KERB_HEIGHT, "gap", ImportFaults())
            for part in parts_of(_wide_parts(area_outside(gap, taken)))
        )
    filled = [of_square for of_square in surfaces.values() if of_square]
    for number, of_square in enumerate(filled):
        surface = np.concatenate(of_square)
        yield paved_structure(f"sidewalk_gap_{number}", "sidewalk", surface)


def _gaps_beside(
    walks: Sequence[BaseGeometry],
    walks_tree: STRtree,
    objects: Sequence[ImportedObject],
) -> BaseGeometry:
    """Returns the narrow gaps between sidewalks, roads and buildings in W [m].

    Args:
        walks: areas of the sidewalks [m].
        walks_tree: search tree of these areas.
        objects: objects of the city, which include roads and buildings.
    """
    roads = [
        _flat_outline(imported)
        for imported in objects
        if imported.object_type == "Road"
    ]
    houses = [o for o in objects if o.structure.semantic_class == "building"]
    roofs = triangles_from_above(houses)
    beside = walks_tree.query(roofs, "dwithin", _WIDEST_GAP)[0]
    covered = shapely.union_all([*walks, *roads, *roofs[np.unique(beside)]])
    half = _WIDEST_GAP / 2.0
    closed = covered.buffer(half, quad_segs=2).buffer(-half, quad_segs=2)
    return shapely.difference(closed, covered, grid_size=GRID)


def _wide_parts(area: BaseGeometry) -> BaseGeometry:
    """Returns an area without the parts that are too narrow to be paved."""
    half = _NARROWEST_GAP / 2.0
    inside = area.buffer(-half, quad_segs=2)
    wide = polygons_only(inside.buffer(half, quad_segs=2))
    return shapely.intersection(wide, area, grid_size=GRID)


def _flat_outline(imported: ImportedObject) -> BaseGeometry:
    """Returns the area of a level structure, seen from above."""
    return shapely.coverage_union_all(triangles_from_above([imported]))
