"""Dresses imported buildings: adds details to their walls and roofs."""

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
import math

from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
import numpy as np
from scipy.spatial import KDTree
import shapely
from shapely.geometry import LineString, MultiLineString, Polygon, box
from shapely.geometry.base import BaseGeometry

from evaluation.base import dot
from worlds.imports.dressing import facade_pieces
from worlds.imports.dressing.facade_plan import (
    FacadePlan,
    plan_facade,
    with_doors,
    with_shops,
)
from worlds.imports.dressing.styles import Style, make_style
from worlds.imports.dressing.wall_panels import Panel, find_panels, is_upright
from worlds.imports.drives.steerable_drives import WaypointRoute
from worlds.imports.faces import joined_triangles
from worlds.imports.ground import Ground
from worlds.imports.imported_objects import Base, ImportedObject, to_mesh
from worlds.imports.named_randomness import random_generator
from worlds.imports.streets import Street
from worlds.shapes import (
    GRID,
    Assembly,
    Finish,
    MeshShape,
    Model,
    Site,
    UpperSides,
    add_chimney,
    equip_roof,
    long_normals,
    looks_up,
    turned_up,
    unit_normals,
)

# Walls farther than this from all drives get no windows [m].
_WALLS_WITHIN = 60.0
# Roofs farther than this from all drives get no equipment [m].
_ROOFS_WITHIN = 100.0
# About this many triangles are used for openings, first on the nearest walls.
_MOST_TRIANGLES = 1_100_000
# About this many triangles are needed for an opening. A wall has about one
# opening for this much of its area [m^2].
_TRIANGLES_OF_OPENING = 30
_AREA_OF_OPENING = 9.0
# About this many triangles are needed per wall in addition.
_TRIANGLES_OF_WALL = 40
# Shops are on walls at most this far from a street [m].
_SHOPS_WITHIN = 16.0
# From this level of detail on, a model has its own roof.
_LOD_WITH_ROOF = 2.2
# From this level of detail on, a model has its own windows.
_LOD_WITH_WINDOWS = 3.0
# Places in front of a wall at which the ground is looked up: distance from the
# wall [m].
_BEFORE_WALL = 1.0
_NO_TRIANGLES = np.zeros((0, 3, 3))
# A building whose feet are farther from the ground than this was sunk into it
# [m].
_MOST_SUNK = 2.0
# Share of the box around a footprint that the footprint is assumed to fill.
_FILLED_SHARE = 0.8
# Least height of a building that gets a style [m].
_LEAST_HEIGHT = 1.0
# Distance between the places on drives from which walls are looked at [m].
_SPACING = 4.0
# Height of the eyes above the ground [m].
_EYES = 2.0
# A wall is looked at from this many of the nearest places.
_NEAREST = 8
# A wall is also looked at from about this many other places.
_OTHERS = 24
# Probes of a wall are at these parts of its length and height. The wall is
# visible if one of its probes is visible.
_PROBES = np.array([(x, z) for x in (0.04, 0.5, 0.96) for z in (0.3, 1.0)])
# Probes are this far in front of the wall [m].
_BEFORE = 0.3
# The highest probes are this far below the top of the wall [m].
_BELOW_TOP = 0.3


@dataclass(frozen=True)
class DressedBuildings:
    """The buildings of a city with details, and counts of the details.

    Attributes:
        buildings: original building -> building with details.
        at_random: kind of detail -> number of random details.
        by_file: kind of appearance, such as a colour -> number of buildings of
            which the file states this appearance.
    """

    buildings: Mapping[ImportedObject, ImportedObject]
    at_random: Counter[str]
    by_file: Counter[str]


def dress_buildings(
    objects: Sequence[ImportedObject],
    drives: Sequence[WaypointRoute],
    streets: Sequence[Street],
    ground: Ground,
    seed: int,
    always: AbstractSet[ImportedObject],
    paving: np.ndarray,
) -> DressedBuildings:
    """Returns the buildings of a city, with added windows, doors and shops.

    A building looks the same in each stage and each import, because its random
    numbers depend only on the seed and on the building's name. Only walls near
    a drive get windows. Doors and shops face streets.

    Args:
        objects: the objects of the city, of which the buildings get details.
        drives: the drives; there is more detail near drives than elsewhere.
        streets: the streets that doors and shops face.
        ground: the ground on which buildings stand.
        seed: seed of all random draws.
        always: objects that exist in all stages. A wall gets no details if
            such buildings occlude it from the drives.
        paving: triangles (M, 3, 3) of terrain, streets and sidewalks, on which
            doors stand [m].
    """
    buildings = [one for one in objects if one.is_building]
    bare = _split_buildings(buildings, ground, seed)
    walls: Mapping[int, list[FacadePlan]] = {}
    if drives and bare:
        hiding = [b.triangles for b in buildings if b in always]
        views = _DriveViews(drives, ground, joined_triangles(hiding))
        upper = UpperSides(turned_up(paving))
        walls = _plan_facades(bare, drives, streets, ground, views, upper)
    paths = MultiLineString([drive.path for drive in drives])
    at_random: Counter[str] = Counter()
    by_file: Counter[str] = Counter()
    dressed = {}
    for number, building in enumerate(bare):
        model, counts = _dress_building(
            building, walls.get(number, ()), paths, seed
        )
        at_random += counts
        by_file.update(building.style.by_tag)
        imported = building.imported
        structure = replace(imported.structure, model=model)
        dressed[imported] = replace(imported, structure=structure)
    return DressedBuildings(dressed, at_random, by_file)


@dataclass(frozen=True)
class _BareBuilding:
    """An imported building, split into surfaces that details can be added to.

    Attributes:
        imported: the building as imported, without details.
        walls: triangles (M, 3, 3) of the walls [m].
        roof: triangles (M, 3, 3) of the roof [m].
        rest: triangles (M, 3, 3) of all other surfaces [m].
        base: height of the lowest floor in W [m].
        style: appearance of the building.
        is_flat: whether the roof is flat.
    """

    imported: ImportedObject
    walls: np.ndarray
    roof: np.ndarray
    rest: np.ndarray
    base: float
    style: Style
    is_flat: bool
    rng: np.random.Generator


def _split_buildings(
    buildings: Sequence[ImportedObject], ground: Ground, seed: int
) -> list[_BareBuilding]:
    """Returns buildings, split into walls, roof and other surfaces.

    A variant of a building, such as a lower building in an earlier stage, has
    the style of the original.

    Args:
        ground: the ground on which they stand.
    """
    split = []
    styles: dict[str, Style] = {}
    variants_last = sorted(buildings, key=lambda one: one.original != "")
    for building in variants_last:
        style = styles.get(building.original)
        bare = _split_building(building, ground, seed, style)
        styles[building.draw_name] = bare.style
        split.append(bare)
    return split


def _split_building(
    building: ImportedObject,
    ground: Ground,
    seed: int,
    known: Style | None = None,
) -> _BareBuilding:
    """Returns a building, split into walls, roof and other surfaces.

    For a variant, `known` is the style of the original. The other arguments are
    as for `_split_buildings`.
    """
    surfaces = {"body": np.zeros((0, 3, 3)), "roof": np.zeros((0, 3, 3))}
    for part in building.structure.model.parts:
        if isinstance(part.shape, MeshShape):
            mesh = building.structure.model.meshes[part.shape.mesh]
            surfaces[part.name] = mesh.vertices[mesh.triangles()]
    body = surfaces["body"]
    upright, up = is_upright(body), looks_up(body)
    roof = np.concatenate([surfaces["roof"], body[up]])
    walls, rest = body[upright], body[~upright & ~up]
    corners = building.triangles.reshape(-1, 3)
    base = float(building.foot[2])
    if building.base is Base.GROUND:
        below = float(ground.height(corners[:, :2]).min())
        base = base if abs(base - below) < _MOST_SUNK else below
    width, depth = np.ptp(corners[:, :2], axis=0)
    standing = walls if len(walls) else building.triangles
    height = max(_LEAST_HEIGHT, float(standing[:, :, 2].max()) - base)
    is_flat = bool(len(roof)) and _is_flat_roof(roof)
    rng = random_generator(seed, "dressing", building.draw_name)
    area = _FILLED_SHARE * float(width * depth)
    style = make_style(building.tags, building.year, area, height, is_flat, rng)
    if known is not None:
        storeys = max(1, round(height / known.storey))
        style = replace(known, storey=height / storeys)
    return _BareBuilding(building, walls, roof, rest, base, style, is_flat, rng)


def _dress_building(
    building: _BareBuilding,
    plans: Sequence[FacadePlan],
    paths: BaseGeometry,
    seed: int,
) -> tuple[Model, Counter[str]]:
    """Returns the model of a dressed building, and counts of random details.

    Args:
        plans: plans of the walls that get details; all other walls stay bare.
        paths: paths of the drives in W [m].
    """
    imported, style = building.imported, building.style
    footprint = imported.structure.model.footprint
    site = Site(Polygon(), imported.structure.name)
    out = Assembly(site, building.rng)
    out.declare_materials(
        body=style.wall,
        doors=style.door,
        frames=style.frame,
        glass=style.glass,
        roof=style.roof,
        sign=style.sign,
        trim=style.trim,
    )
    planned = {
        triangle.tobytes()
        for plan in plans
        for triangle in plan.panel.triangles
    }
    bare = [
        triangle
        for triangle in building.walls
        if triangle.tobytes() not in planned
    ]
    walls = np.array(bare).reshape(-1, 3, 3)
    out.add_to("body", to_mesh(walls), to_mesh(building.rest))
    out.add_to("roof", to_mesh(building.roof))
    counts: Counter[str] = Counter()
    for plan in plans:
        # The name must not depend on the map's origin, nor on a last bit: no
        # heading is -0 or -180.
        x, y = plan.panel.along.round(9) + 0.0
        heading = round(math.degrees(math.atan2(y, x)), 6)
        wall = f"wall {round(plan.panel.length, 6):.1f} {heading:.0f}"
        rng = random_generator(seed, wall, imported.draw_name)
        counts += facade_pieces.add_facade(out, plan, rng)
    has_own_roof = imported.lod >= _LOD_WITH_ROOF or not len(building.roof)
    if not has_own_roof and shapely.dwithin(footprint, paths, _ROOFS_WITHIN):
        _add_roof_pieces(out, building.roof, style, building.is_flat)
    counts["roof equipment and chimneys"] = len(out.parts)
    return out.to_model(footprint), counts


class _DriveViews:
    """Viewpoints along drives, to find out which walls are visible."""

    def __init__(
        self,
        drives: Sequence[WaypointRoute],
        ground: Ground,
        solids: np.ndarray,
    ):
        """Takes viewpoints along the drives, of which there is at least one.

        `solids` (M, 3, 3) are the triangles that occlude walls in all stages
        [m].
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

    def are_near(self, limits: np.ndarray) -> np.ndarray:
        """Returns (N,) bool: whether boxes are near a drive.

        `limits` (N, 2, 2) contains the least and the greatest x and y of each
        box [m]. A box counts as near if the circle around it is at most 60 m
        from a viewpoint.
        """
        middles = limits.mean(axis=1)
        reach = np.linalg.norm(limits[:, 1] - middles, axis=1)
        return np.asarray(self._tree.query(middles)[0] <= reach + _WALLS_WITHIN)

    def distances(self, panels: Sequence[Panel]) -> np.ndarray:
        """Returns the distance from which drives see each wall, (N,) [m].

        This is the distance from the wall to the nearest viewpoint on a drive
        from which the wall is visible; infinite without such a viewpoint within
        60 m.
        """
        facing = [self._facing_places(panel) for panel in panels]
        counts = [len(distances) for _, distances in facing]
        if not sum(counts):
            return np.full(len(panels), np.inf)
        number = np.repeat(np.arange(len(panels)), counts)
        place = np.concatenate([places for places, _ in facing])
        distance = np.concatenate([distances for _, distances in facing])
        probes = []
        for panel in panels:
            top = max(panel.height - _BELOW_TOP, panel.height / 2.0)
            x, z = _PROBES.T * [[panel.length], [top]]
            probes.append(panel.place(x, z, _BEFORE))
        is_seen = self._is_seen(np.stack(probes)[number], self._eyes[place])
        nearest = np.full(len(panels), np.inf)
        np.minimum.at(nearest, number[is_seen], distance[is_seen])
        return nearest

    def _facing_places(self, panel: Panel) -> tuple[np.ndarray, np.ndarray]:
        """Returns the places that face a panel, and their distances.

        The result is two arrays (K,): numbers of places at most 60 m from the
        panel, and their distances from the panel [m]. The nearest places are
        all included, of the others only some.
        """
        most = _WALLS_WITHIN
        middle = panel.origin[:2] + panel.along * panel.length / 2.0
        near = self._tree.query_ball_point(middle, most + panel.length / 2.0)
        index = np.array(near, dtype=int)
        from_start = self._xy[index] - panel.origin[:2]
        out = dot(from_start, panel.outward)
        x = dot(from_start, panel.along)
        aside = np.maximum(np.maximum(-x, x - panel.length), 0.0)
        distance = np.hypot(out, aside)
        usable = np.flatnonzero((out > 0.0) & (distance <= most))
        usable = usable[np.argsort(distance[usable].round(6), kind="stable")]
        step = max(1, (len(usable) - _NEAREST) // _OTHERS)
        usable = np.append(usable[:_NEAREST], usable[_NEAREST::step])
        return index[usable], distance[usable]

    def _is_seen(self, probes: np.ndarray, eyes: np.ndarray) -> np.ndarray:
        """Returns (K,) bool: whether eyes see any of their probes.

        `eyes` (K, 3) and `probes` (K, P, 3) are places in W [m].
        """
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


def _plan_facades(
    bare: Sequence[_BareBuilding],
    drives: Sequence[WaypointRoute],
    streets: Sequence[Street],
    ground: Ground,
    views: _DriveViews,
    paving: UpperSides,
) -> dict[int, list[FacadePlan]]:
    """Returns the plans of the walls to dress, by the building's number.

    Args:
        streets: the streets, on which doors and shops are.
        ground: the ground on which buildings stand.
        views: viewpoints on the drives, from which walls are visible.
        paving: upper sides of the paving in front of the walls.
    """
    walls = [
        building.walls
        if building.imported.lod < _LOD_WITH_WINDOWS
        else _NO_TRIANGLES
        for building in bare
    ]
    panels, to_drive = _visible_panels(walls, views)
    if not panels:
        return {}
    before = np.array(
        [p.place(p.length / 2, 0.0, _BEFORE_WALL) for p in panels]
    )
    heights = ground.height(before[:, :2])
    plans = [
        plan_facade(
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
    solids = [building.imported.triangles for building in bare]
    plans = _without_occluded(plans, np.concatenate(solids))
    lines = [street.line for street in streets]
    ways = MultiLineString([*lines, *(drive.path for drive in drives)])
    to_way = np.asarray(shapely.distance(shapely.points(before[:, :2]), ways))
    return _with_fronts(plans, to_way, paving)


def _without_occluded(
    plans: Sequence[FacadePlan], solids: np.ndarray
) -> list[FacadePlan]:
    """Returns plans without openings that buildings occlude.

    `solids` (M, 3, 3) are the triangles of all buildings in W [m].
    """
    probes = [plan.probes() for plan in plans]
    are_hidden = UpperSides(solids).hides(np.concatenate(probes))
    ends = np.cumsum([len(of_plan) for of_plan in probes])[:-1]
    return [
        plan.without(is_hidden)
        for plan, is_hidden in zip(
            plans, np.split(are_hidden, ends), strict=True
        )
    ]


def _with_fronts(
    plans: Sequence[FacadePlan], to_way: np.ndarray, paving: UpperSides
) -> dict[int, list[FacadePlan]]:
    """Adds doors and shops to plans; returns the plans by building number.

    Args:
        plans: plans of walls.
        to_way: distance of each wall from the nearest street or drive [m]. A
            building gets its door in the nearest of its walls on a street.
        paving: upper sides of the paving in front of the walls.
    """
    walls_of: defaultdict[int, list[int]] = defaultdict(list)
    for wall, plan in enumerate(plans):
        walls_of[plan.panel.building].append(wall)
    plans_of: dict[int, list[FacadePlan]] = {}
    for building, walls in walls_of.items():
        on_street = [wall for wall in walls if plans[wall].on_street]
        front = min(
            on_street, key=lambda k: (to_way[k].round(6), k), default=None
        )
        plans_of[building] = []
        for wall in walls:
            plan = plans[wall]
            if plan.style.shops and to_way[wall] < _SHOPS_WITHIN:
                plan = with_shops(plan, paving)
            if wall == front:
                plan = with_doors(plan, paving)
            plans_of[building].append(plan)
    return plans_of


def _visible_panels(
    walls: Sequence[np.ndarray], views: _DriveViews
) -> tuple[list[Panel], np.ndarray]:
    """Returns the plane walls visible from drives, and their distances [m].

    The walls nearest to drives come first. Only as many walls are returned as
    the limit of triangles allows. `walls` has the vertical triangles (M, 3, 3)
    of each building [m].
    """
    panels = find_panels(walls, views.are_near)
    panels = [panel for panel in panels if panel.is_plane]
    distances = views.distances(panels)
    order = np.argsort(distances.round(6), kind="stable")
    order = order[distances[order] <= _WALLS_WITHIN]
    costs = [
        _TRIANGLES_OF_WALL
        + _TRIANGLES_OF_OPENING * panel.length * panel.height / _AREA_OF_OPENING
        for panel in (panels[k] for k in order)
    ]
    order = order[np.cumsum(costs) <= _MOST_TRIANGLES]
    return [panels[k] for k in order], distances[order]


# A roof is level if the z of its unit normal is greater than this.
_LEVEL_COSINE = 0.999
# Level parts have the same height if they differ by less than this [m].
_SAME_HEIGHT = 0.1
# A roof is flat if at least this share of its area is level.
_FLAT_PART = 0.6
# Level parts smaller than this get no equipment [m^2].
_LEAST_ROOF = 40.0
# Roof area per piece of equipment [m^2].
_AREA_OF_ITEM = 90.0
# Greatest number of pieces of equipment on a roof.
_MOST_ITEMS = 6
# Use of a building -> the equipment of its roof, the first piece first.
_ITEMS = {
    "flats": "stair_house vents skylight tank vents dish",
    "office": "lift_house air_handler ac_unit ac_unit vents cooling_tower",
    "retail": "air_handler ac_unit skylight vents ac_unit dish",
    "public": "stair_house air_handler skylight vents ac_unit mast",
    "industrial": "skylight vents skylight vents air_handler tank",
    "house": "vents dish",
}
# Uses of buildings with chimneys.
_WITH_CHIMNEYS = ("house", "flats", "public")
_BRICK = Finish((0.45, 0.27, 0.22), "brick")
# Depth of a chimney's foot below the ridge [m].
_BELOW_RIDGE = 0.35
# A ridge longer than this has two chimneys [m].
_SHORT_RIDGE = 15.0
# Chimneys stand on this range of a ridge's length, in shares of the length.
_CHIMNEY_PLACES = (0.12, 0.88)
# Probability that a chimney is a row of chimneys.
_ROW_SHARE = 0.3
# Chimneys are left out where the roof is lower than the ridge by this [m].
_MOST_BELOW = 1.0
# Scale of a chimney relative to the shared mesh.
_CHIMNEY_SCALE = 0.6
# Points of a ridge are at most this far below its highest one [m].
_RIDGE_TOLERANCE = 0.15


def _is_flat_roof(roof: np.ndarray) -> bool:
    """Returns whether most of the area of a roof is level.

    `roof` contains the triangles (M, 3, 3) of the roof [m].
    """
    above = np.abs(long_normals(roof)[:, 2])
    level = np.abs(unit_normals(roof)[:, 2]) > _LEVEL_COSINE
    return bool(above[level].sum() >= _FLAT_PART * above.sum())


def _add_roof_pieces(
    out: Assembly, roof: np.ndarray, style: Style, is_flat: bool
) -> None:
    """Adds equipment to a flat roof, or chimneys to a pitched roof.

    Args:
        out: the building under assembly, which gets the parts.
        roof: triangles (M, 3, 3) of the roof [m].
        style: style of the building; the use of the building decides what is
            added.
        is_flat: whether the roof is flat.
    """
    items = _ITEMS.get(style.use, "").split()
    if is_flat and items and (level := _largest_level_part(roof)) is not None:
        area, z = level
        count = min(_MOST_ITEMS, len(items), int(area.area / _AREA_OF_ITEM) + 1)
        ring = np.array(area.exterior.coords)[:-1]
        equip_roof(out, ring, z, items[:count])
    if not is_flat and style.use in _WITH_CHIMNEYS:
        _add_chimneys(out, roof)


def _largest_level_part(roof: np.ndarray) -> tuple[Polygon, float] | None:
    """Returns a roof's largest level part, without holes, and the part's z.

    The result is None if no level part is large enough for equipment.
    """
    level = roof[unit_normals(roof)[:, 2] > _LEVEL_COSINE]
    best: tuple[Polygon, float] | None = None
    if not len(level):
        return None
    steps = np.round(level[:, :, 2].mean(axis=1) / _SAME_HEIGHT)
    for step in np.unique(steps):
        alike = level[steps == step]
        whole = shapely.union_all(
            [Polygon(triangle) for triangle in np.round(alike[:, :, :2], 3)],
            grid_size=GRID,
        )
        for part in shapely.get_parts(whole):
            if isinstance(part, Polygon) and part.area > _LEAST_ROOF:
                part = _without_holes(part)
                if best is None or part.area > best[0].area:
                    best = part, float(alike[:, :, 2].max())
    return best


def _without_holes(area: Polygon) -> Polygon:
    """Divides an area at its holes, and returns the largest piece."""
    while area.interiors:
        x0, y0, x1, y1 = area.bounds
        x = Polygon(area.interiors[0]).centroid.x
        halves = [
            part
            for half in (box(x0, y0, x, y1), box(x, y0, x1, y1))
            for part in shapely.get_parts(area.intersection(half))
            if isinstance(part, Polygon)
        ]
        area = max(halves, key=lambda part: round(part.area, 6))
    return area


def _add_chimneys(out: Assembly, roof: np.ndarray) -> None:
    """Adds one or two chimneys at random places on the ridge of a roof."""
    corners = roof.reshape(-1, 3)
    ridge = corners[corners[:, 2] > corners[:, 2].max() - _RIDGE_TOLERANCE]
    start = ridge[np.lexsort(ridge[:, 1::-1].round(6).T)[0]]
    end = ridge[np.linalg.norm(ridge - start, axis=1).round(6).argmax()]
    length = float(np.linalg.norm(end - start, axis=0))
    yaw = math.atan2(end[1] - start[1], end[0] - start[0])
    sides = UpperSides(roof)
    count = 1 + int(length > _SHORT_RIDGE)
    # Two numbers are sampled for any roof.
    shares = out.rng.uniform(*_CHIMNEY_PLACES, 2)[:count]
    for k, share in enumerate(shares):
        x, y, z = start + share * (end - start)
        height = float(sides.heights(np.array([[x, y]]))[0])
        # There may be no ridge between two gables.
        if height > z - _MOST_BELOW:
            is_row = out.rng.random() < _ROW_SHARE
            item = "chimney_row" if is_row else "chimney"
            scale = (_CHIMNEY_SCALE, _CHIMNEY_SCALE, _CHIMNEY_SCALE)
            xyz = (x, y, height - _BELOW_RIDGE)
            part = f"chimney_{k}"
            add_chimney(out, part, xyz, _BRICK, item=item, yaw=yaw, scale=scale)
