"""Dresses a city: adds details to its buildings and along its streets.

It also records which structures were added.
"""

from collections import Counter, defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
import numpy as np
from scipy.spatial import KDTree
import shapely
from shapely.geometry import LineString, MultiLineString, Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.base.errors import InputError
from cns_drake.city.facades.assembly import Assembly, Site
from cns_drake.city.geometry import (
    MeshShape,
    Model,
    Structure,
    UpperSides,
    looks_up,
    turned_up,
)
from cns_drake.imports.dressing import facade_pieces, grounds
from cns_drake.imports.dressing.facade_pieces import FacadePlan
from cns_drake.imports.dressing.street_dressing import dress_streets
from cns_drake.imports.dressing.styles import Style, make_style
from cns_drake.imports.dressing.wall_panels import (
    Panel,
    find_panels,
    is_upright,
)
from cns_drake.imports.drives.search import WaypointRoute
from cns_drake.imports.faces import joined
from cns_drake.imports.foreign_city import (
    ForeignCity,
    Imported,
    Street,
    random_generator,
    to_mesh,
)
from cns_drake.imports.ground import Ground, ground_structures
from cns_drake.imports.staged_city import StagedCity
from cns_drake.scene.labels import MAX_INSTANCE

# A building whose feet are farther from the ground than this was sunk into it
# [m].
_LET_IN = 2.0


@dataclass(frozen=True)
class Bare:
    """An imported building, split into surfaces that details can be added to.

    Attributes:
        one: the building.
        walls: triangles (M, 3, 3) of the walls [m].
        roof: triangles (M, 3, 3) of the roof [m].
        rest: triangles (M, 3, 3) of all other surfaces [m].
        base: height of the lowest floor in W [m].
        style: appearance of the building.
        is_flat: whether the roof is flat.
        rng: random generator for the details.
    """

    one: Imported
    walls: np.ndarray
    roof: np.ndarray
    rest: np.ndarray
    base: float
    style: Style
    is_flat: bool
    rng: np.random.Generator


def all_laid_bare(
    buildings: Sequence[Imported], ground: Ground, seed: int
) -> list[Bare]:
    """Returns buildings, split into walls, roof and other surfaces.

    A variant of a building, such as a lower one in an earlier stage, has the
    style of the original.

    Args:
        buildings: the buildings.
        ground: the ground on which they stand.
        seed: seed of the random styles.
    """
    found = []
    styles: dict[str, Style] = {}
    for one in sorted(buildings, key=lambda one: one.original != ""):
        some = _laid_bare(one, ground, seed, styles.get(one.original))
        styles[one.draw_name] = some.style
        found.append(some)
    return found


def _laid_bare(
    one: Imported, ground: Ground, seed: int, known: Style | None = None
) -> Bare:
    surfaces = {"body": np.zeros((0, 3, 3)), "roof": np.zeros((0, 3, 3))}
    for part in one.structure.model.parts:
        if isinstance(part.shape, MeshShape):
            mesh = one.structure.model.meshes[part.shape.mesh]
            surfaces[part.name] = mesh.vertices[mesh.triangles()]
    body = surfaces["body"]
    upright, up = is_upright(body), looks_up(body)
    roof = np.concatenate([surfaces["roof"], body[up]])
    walls, rest = body[upright], body[~upright & ~up]
    corners = one.triangles.reshape(-1, 3)
    foot = float(corners[:, 2].min())
    below = float(ground.height(corners[:, :2]).min())
    base = foot if abs(foot - below) < _LET_IN else below
    width, depth = np.ptp(corners[:, :2], axis=0)
    top = walls if len(walls) else one.triangles
    height = max(1.0, float(top[:, :, 2].max()) - base)
    is_flat = bool(len(roof)) and facade_pieces.is_flat_roof(roof)
    rng = random_generator(seed, "dressing", one.draw_name)
    area = 0.8 * float(width * depth)
    style = make_style(one.tags, one.year, area, height, is_flat, rng)
    if known is not None:
        storeys = max(1, round(height / known.storey))
        style = replace(known, storey=height / storeys)
    return Bare(one, walls, roof, rest, base, style, is_flat, rng)


# Distance between the places on drives from which walls are looked at [m].
_SPACING = 4.0
# Height of the eyes above the ground [m].
_EYES = 2.0
# A wall is looked at from this many of the nearest places.
_NEAREST = 8
# It is also looked at from about this many others.
_OTHERS = 24
# A wall is visible if one of its probes is. Probes are at these parts of its
# length and height.
_PROBES = np.array([(x, z) for x in (0.04, 0.5, 0.96) for z in (0.3, 1.0)])
# Probes are this far in front of the wall [m].
_BEFORE = 0.3
# The highest probes are this far below its top [m].
_BELOW_TOP = 0.3


class DriveViews:
    """Viewpoints along drives, to find out which walls are visible."""

    def __init__(
        self,
        drives: Sequence[WaypointRoute],
        ground: Ground,
        solids: np.ndarray,
    ):
        """Prepares the places of at least one drive.

        Solids (M, 3, 3) hide other things at all stages [m].
        """
        paths = [LineString(drive.path) for drive in drives]
        self._xy = shapely.get_coordinates(shapely.segmentize(paths, _SPACING))
        z = ground.height(self._xy) + _EYES
        self._eyes = np.column_stack([self._xy, z])
        self._tree = KDTree(self._xy)
        self._scene = None
        # Embree computes in float32, so coordinates are relative to the middle
        # of the places.
        self._middle = np.array([*self._xy.mean(axis=0), 0.0])
        if len(solids):
            self._scene = EmbreeScene()
            TriangleMesh(self._scene, (solids - self._middle).astype("f4"))

    def are_near(self, limits: np.ndarray, distance: float) -> np.ndarray:
        """Returns (N,) bool: whether boxes are near a drive.

        `limits` (N, 2, 2) contains the least and the greatest x and y of each
        box [m]. A box counts as near if the circle around it is at most
        `distance` [m] from a viewpoint.
        """
        middles = limits.mean(axis=1)
        reach = np.linalg.norm(limits[:, 1] - middles, axis=1)
        return np.asarray(self._tree.query(middles)[0] <= reach + distance)

    def distances(self, panels: Sequence[Panel], most: float) -> np.ndarray:
        """Returns how far from a drive each wall is seen, (N,) [m].

        This is the distance from the wall to the nearest viewpoint on a drive
        from which the wall is visible; infinite without such a viewpoint.

        Args:
            panels: the N walls.
            most: greatest distance at which a viewpoint counts [m].
        """
        pairs = [self._looks(panel, most) for panel in panels]
        counts = [len(distance) for _, distance in pairs]
        if not sum(counts):
            return np.full(len(panels), np.inf)
        number = np.repeat(np.arange(len(panels)), counts)
        place = np.concatenate([some for some, _ in pairs])
        distance = np.concatenate([some for _, some in pairs])
        probes = []
        for panel in panels:
            top = max(panel.height - _BELOW_TOP, panel.height / 2.0)
            x, z = _PROBES.T * [[panel.length], [top]]
            probes.append(panel.place(x, z, _BEFORE))
        is_seen = self._is_seen(np.stack(probes)[number], self._eyes[place])
        found = np.full(len(panels), np.inf)
        np.minimum.at(found, number[is_seen], distance[is_seen])
        return found

    def _looks(
        self, panel: Panel, most: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns (K,) which places face a panel, and their distances [m]."""
        middle = panel.origin[:2] + panel.along * panel.length / 2.0
        near = self._tree.query_ball_point(middle, most + panel.length / 2.0)
        index = np.array(near, dtype=int)
        from_start = self._xy[index] - panel.origin[:2]
        out = from_start @ panel.outward
        x = from_start @ panel.along
        aside = np.maximum(np.maximum(-x, x - panel.length), 0.0)
        distance = np.hypot(out, aside)
        usable = np.flatnonzero((out > 0.0) & (distance <= most))
        usable = usable[np.argsort(distance[usable], kind="stable")]
        step = max(1, (len(usable) - _NEAREST) // _OTHERS)
        usable = np.append(usable[:_NEAREST], usable[_NEAREST::step])
        return index[usable], distance[usable]

    def _is_seen(self, probes: np.ndarray, eyes: np.ndarray) -> np.ndarray:
        """Returns (K,) which eyes (K, 3) see any of their probes (K, P, 3)."""
        if self._scene is None:
            return np.ones(len(eyes), dtype=bool)
        starts = np.repeat(eyes - self._middle, probes.shape[1], axis=0)
        ways = (probes - self._middle).reshape(-1, 3) - starts
        hits = self._scene.run(
            starts.astype("f4"),
            ways.astype("f4"),
            np.ones(len(ways), dtype="f4"),
            query="OCCLUDED",
        )
        return np.asarray((hits < 0).reshape(len(eyes), -1).any(axis=1))


# Walls farther than this from all drives get no windows [m].
_WALLS_WITHIN = 60.0
# Roofs farther than this from all drives get no equipment [m].
_ROOFS_WITHIN = 100.0
# About this many triangles are used for openings, first on the nearest walls.
_MOST_TRIANGLES = 1_100_000
# About this many triangles are needed per 9 m^2 of a wall, for its openings.
_TRIANGLES_OF_OPENING = 30
# About this many triangles are needed per wall in addition.
_TRIANGLES_OF_WALL = 40
# Shops are on walls at most this far from a street [m].
_SHOPS_WITHIN = 16.0
# From this level of detail on, a model has its own roof.
_LOD_WITH_ROOF = 2.2
# From this level of detail on, a model has its own windows.
_LOD_WITH_WINDOWS = 3.0
_NO_TRIANGLES = np.zeros((0, 3, 3))


@dataclass(frozen=True)
class DressedBuildings:
    """The buildings of a city with details, and counts of the details.

    Attributes:
        buildings: original building -> building with details.
        at_random: kind of detail -> number of random details.
        by_file: kind of appearance, such as a colour -> number of buildings for
            which the file determines it.
    """

    buildings: Mapping[Imported, Imported]
    at_random: Counter[str]
    by_file: Counter[str]


def dress_buildings(
    structures: Sequence[Imported],
    drives: Sequence[WaypointRoute],
    streets: Sequence[Street],
    ground: Ground,
    seed: int,
    always: Collection[Imported] | None = None,
    paving: np.ndarray = _NO_TRIANGLES,
) -> DressedBuildings:
    """Returns the buildings of a city with windows, doors and shops.

    A building looks the same in each stage and each import, because its random
    numbers depend only on the seed and its name. Only walls near a drive get
    windows. Doors and shops face streets.

    Args:
        structures: the structures of the city, of which the buildings get
            details.
        drives: the drives, near which there is more detail.
        streets: the streets that doors and shops face.
        ground: the ground on which buildings stand.
        seed: seed of all random draws.
        always: structures that exist in all stages; None if all do. A wall gets
            no details if buildings that exist in all stages occlude it from the
            drives.
        paving: triangles (M, 3, 3) of terrain, streets and sidewalks, on which
            doors stand [m].
    """
    buildings = [one for one in structures if one.kind.startswith("Building")]
    bare = all_laid_bare(buildings, ground, seed)
    walls: Mapping[int, list[FacadePlan]] = {}
    if drives and bare:
        lasting = set(buildings if always is None else always)
        hiding = [b.triangles for b in buildings if b in lasting]
        views = DriveViews(drives, ground, joined(hiding))
        upper = UpperSides(turned_up(paving))
        walls = _plans(bare, drives, streets, ground, views, upper)
    paths = MultiLineString([drive.path for drive in drives])
    at_random: Counter[str] = Counter()
    by_file: Counter[str] = Counter()
    dressed = {}
    for number, some in enumerate(bare):
        model, counts = _dressed(some, walls.get(number, ()), paths, seed)
        at_random += counts
        by_file.update(some.style.by_tag)
        structure = replace(some.one.structure, model=model)
        dressed[some.one] = replace(some.one, structure=structure)
    return DressedBuildings(dressed, at_random, by_file)


def _dressed(
    some: Bare, plans: Sequence[FacadePlan], paths: BaseGeometry, seed: int
) -> tuple[Model, Counter[str]]:
    """Returns the model of a dressed building, and counts of random details."""
    structure, style = some.one.structure, some.style
    footprint = structure.model.footprint
    out = Assembly(Site(Polygon(), structure.name), some.rng)
    out.paint(
        body=style.wall,
        doors=style.door,
        frames=style.frame,
        glass=style.glass,
        roof=style.roof,
        sign=style.sign,
        trim=style.trim,
    )
    planned = {one.tobytes() for plan in plans for one in plan.panel.triangles}
    bare = [one for one in some.walls if one.tobytes() not in planned]
    walls = np.array(bare).reshape(-1, 3, 3)
    out.add_to("body", to_mesh(walls), to_mesh(some.rest))
    out.add_to("roof", to_mesh(some.roof))
    counts: Counter[str] = Counter()
    for plan in plans:
        # The name must not depend on the map's origin.
        panel = plan.panel
        heading = np.degrees(np.arctan2(panel.along[1], panel.along[0]))
        wall = f"wall {panel.length:.1f} {heading:.0f}"
        rng = random_generator(seed, wall, some.one.draw_name)
        counts += facade_pieces.add_facade(out, plan, rng)
    has_own_roof = some.one.lod >= _LOD_WITH_ROOF or not len(some.roof)
    if not has_own_roof and shapely.dwithin(footprint, paths, _ROOFS_WITHIN):
        facade_pieces.add_roof_pieces(out, some.roof, style, some.is_flat)
    counts["roof equipment and chimneys"] = len(out.parts)
    return out.finish(footprint), counts


def _plans(
    bare: Sequence[Bare],
    drives: Sequence[WaypointRoute],
    streets: Sequence[Street],
    ground: Ground,
    views: DriveViews,
    paving: UpperSides,
) -> dict[int, list[FacadePlan]]:
    """Returns number of a building -> plans of its walls to dress."""
    walls = [
        some.walls if some.one.lod < _LOD_WITH_WINDOWS else np.zeros((0, 3, 3))
        for some in bare
    ]
    panels, to_drive = _seen(walls, views)
    if not panels:
        return {}
    before = np.array([p.place(p.length / 2, 0.0, 1.0) for p in panels])
    heights = ground.height(before[:, :2])
    plans = [
        facade_pieces.plan_facade(
            panel,
            bare[panel.building].style,
            bare[panel.building].base,
            float(height),
            float(distance),
        )
        for panel, height, distance in zip(
            panels, heights, to_drive, strict=True
        )
    ]
    solids = [some.one.triangles for some in bare]
    upper = UpperSides(np.concatenate(solids))
    probes = [plan.probes() for plan in plans]
    hidden = upper.hides(np.concatenate(probes))
    ends = np.cumsum([len(some) for some in probes])[:-1]
    plans = [
        plan.without(some)
        for plan, some in zip(plans, np.split(hidden, ends), strict=True)
    ]
    lines = [street.line for street in streets]
    ways = MultiLineString([*lines, *(drive.path for drive in drives)])
    to_way = np.asarray(shapely.distance(shapely.points(before[:, :2]), ways))
    groups: defaultdict[int, list[int]] = defaultdict(list)
    for k, plan in enumerate(plans):
        groups[plan.panel.building].append(k)
    for members in groups.values():
        possible = [k for k in members if plans[k].on_street]
        # The wall with the building's door.
        front = min(possible, key=lambda k: (to_way[k], k), default=None)
        for k in members:
            plan = plans[k]
            if plan.style.shops and to_way[k] < _SHOPS_WITHIN:
                plan = facade_pieces.with_shops(plan, paving)
            if k == front:
                plan = facade_pieces.with_doors(plan, paving)
            plans[k] = plan
    return {
        number: [plans[k] for k in members]
        for number, members in groups.items()
    }


def _seen(
    walls: Sequence[np.ndarray], views: DriveViews
) -> tuple[list[Panel], np.ndarray]:
    """Returns the plane walls visible from drives, and their distances [m].

    The nearest walls come first, as many as the limit of triangles allows.
    `walls` has the vertical triangles (M, 3, 3) of each building [m].
    """
    panels = find_panels(walls, lambda xy: views.are_near(xy, _WALLS_WITHIN))
    panels = [panel for panel in panels if panel.is_plane]
    distances = views.distances(panels, _WALLS_WITHIN)
    order = np.argsort(distances, kind="stable")
    order = order[distances[order] <= _WALLS_WITHIN]
    cost = [
        _TRIANGLES_OF_WALL
        + _TRIANGLES_OF_OPENING * panel.length * panel.height / 9.0
        for panel in (panels[k] for k in order)
    ]
    order = order[np.cumsum(cost) <= _MOST_TRIANGLES]
    return [panels[k] for k in order], distances[order]


@dataclass(frozen=True)
class Dressing:
    """An imported city with added details, and what was added.

    Attributes:
        city: the city with its details.
        origins: name of a changed or added structure -> `dressed` for a
            structure of the file with added details, or `lot` for a random
            structure. All other structures are as in the file.
        facts: counts of details from the file and of random ones.
        bottom: structures of the guessed ground; empty if the file has a
            terrain.
    """

    city: StagedCity
    origins: Mapping[str, str]
    facts: Mapping[str, Any]
    bottom: Sequence[Structure]


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
        drives: the drives, near which there is more detail.
        ground: the ground.
        seed: seed of all random draws.

    Raises:
        InputError: if there are more structures than a map may have.
    """
    always = set.intersection(*map(set, staged.standing.values()))
    is_paved = grounds.is_dense(staged.kept)
    kept = staged.kept
    streets = city.streets
    # Streets and sidewalks that the file does not have.
    laid: list[Imported] = []
    if drives:
        laid += grounds.missing_sidewalks(kept, streets, drives)
        classes = {one.structure.semantic_class for one in kept}
        if is_paved and streets:
            laid += grounds.paved_gaps([*kept, *laid], drives)
        elif is_paved and classes.isdisjoint(("road", "sidewalk")):
            laid += grounds.guessed_streets(kept, drives, ground)
    paving = [
        one.triangles
        for one in [*kept, *laid]
        if one.is_ground or one.kind == "Sidewalk"
    ]
    buildings = dress_buildings(
        kept, drives, streets, ground, seed, always, joined(paving)
    )
    added = [
        grounds.with_kerb(one) if one.kind == "Sidewalk" else one
        for one in laid
    ]
    if drives:
        added += grounds.lane_marks(streets, drives)
    bottom = ground_structures(kept, ground)
    everything = [*kept, *added]
    things = dress_streets(
        everything, city.things, streets, drives, ground, bottom, seed
    )
    changed = dict(buildings.buildings)
    at_random = buildings.at_random + Counter(one.kind for one in added)
    terrain = [one for one in kept if one.kind == "TINRelief"]
    # True if the file gives only the height of the ground, not its kind.
    if is_paved and sum(one.is_ground for one in kept) == len(terrain):
        changed |= {
            one: replace(one, structure=grounds.paved(one.structure))
            for one in terrain
        }
    if drives:
        walks = [one for one in kept if one.kind == "Sidewalk"]
        changed |= {
            one: grounds.with_kerb(one)
            for one in grounds.near_drives(walks, drives)
        }
    added += things.structures
    for thing in city.things:
        if thing.source in things.sources:
            things.sources.remove(thing.source)
            city.faults.take_back(f"{thing.element}, left out")
    origins = {one.structure.name: "dressed" for one in changed.values()}
    names = {one.structure.name for one in added} - things.from_file
    origins |= dict.fromkeys(names, "lot")
    facts = {
        "seed": seed,
        "buildings": len(buildings.buildings),
        "by_file": dict(sorted((buildings.by_file + things.by_file).items())),
        "at_random": dict(sorted((at_random + things.at_random).items())),
        "without_room": things.no_room,
    }
    dressed = staged.replaced({**changed, **things.moved}).joined(added)
    if len(dressed.kept) >= MAX_INSTANCE:
        raise InputError(
            f"--plain: without it the city has {len(dressed.kept)} structures,"
            f" more than instance ids can count ({MAX_INSTANCE}); or give"
            " --within"
        )
    if is_paved:
        bottom = list(map(grounds.paved, bottom))
    return Dressing(dressed, origins, facts, bottom)
