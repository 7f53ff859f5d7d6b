"""Adds kerbs, sidewalks and carriageways to an imported city."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry import LineString, MultiLineString, MultiPolygon
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry import Mesh, MeshShape, Part, looks_up, turned_up
from cns_drake.imports.drives.search import WaypointRoute
from cns_drake.imports.faces import flat_surface, joined, parts_of
from cns_drake.imports.foreign_city import Imported, Rgb, Street, make_imported
from cns_drake.imports.ground import Ground
from cns_drake.imports.options import ImportFaults

# Within this distance of drives, sidewalks get kerbs and missing ones are added
# [m].
_WITHIN = 80.0
# Height of kerbs above the carriageway [m].
KERB_HEIGHT = 0.12
# The sides of a kerb reach this far down from its upper edges [m].
_KERB_DEPTH = 0.25
# Colour of kerbs.
_KERB: Rgb = (0.60, 0.60, 0.58)
# Width of an added sidewalk [m].
_SIDEWALK = 2.0
# Streets of these kinds have sidewalks unless their tags say otherwise.
_WITH_SIDEWALKS = (
    "primary",
    "secondary",
    "tertiary",
    "unclassified",
    "residential",
)
# Grid size of set operations on areas [m].
_GRID = 0.001


def with_kerb(one: Imported) -> Imported:
    """Returns a sidewalk with a kerb: a vertical face along its whole edge."""
    structure = one.structure
    name = f"{structure.name}_kerb"
    edges = _outer_edges(turned_up(one.triangles))
    if not len(edges):
        return one
    low = edges - [0.0, 0.0, _KERB_DEPTH]
    quads = np.stack([low[:, 0], low[:, 1], edges[:, 1], edges[:, 0]], axis=1)
    corners = np.arange(4 * len(quads)).reshape(-1, 4).tolist()
    mesh = Mesh(quads.reshape(-1, 3), tuple(map(tuple, corners)))
    model = replace(
        structure.model,
        parts=(
            *structure.model.parts,
            Part("kerb", MeshShape(name), rgb=_KERB, material="kerb"),
        ),
        meshes={**structure.model.meshes, name: mesh},
    )
    return replace(one, structure=replace(structure, model=model))


def _outer_edges(triangles: np.ndarray) -> np.ndarray:
    """Returns the edges (N, 2, 3) that only one of triangles (M, 3, 3) has."""
    corners = np.rint(triangles.reshape(-1, 3) * 1000.0).astype(np.int64)
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


def near_drives(
    structures: Sequence[Imported], drives: Sequence[WaypointRoute]
) -> list[Imported]:
    """Returns the structures that are at most 80 m from a drive."""
    paths = MultiLineString([drive.path for drive in drives])
    shapely.prepare(paths)
    outlines = [one.structure.model.footprint for one in structures]
    near = shapely.dwithin(np.array(outlines), paths, _WITHIN)
    return [
        one for one, is_near in zip(structures, near, strict=True) if is_near
    ]


def missing_sidewalks(
    structures: Sequence[Imported],
    streets: Sequence[Street],
    drives: Sequence[WaypointRoute],
) -> Iterator[Imported]:
    """Yields sidewalks for streets whose tags do not mention sidewalks.

    Only the larger streets within 80 m of a drive get sidewalks. The ground
    must be level.

    Args:
        structures: structures of the city, which the sidewalks must not
            overlap.
        streets: the streets.
        drives: the drives, at least one.
    """
    paths = MultiLineString([drive.path for drive in drives])
    near = [
        (street, LineString(street.line))
        for street in streets
        if LineString(street.line).distance(paths) < _WITHIN
    ]
    lacking = [
        (street, line)
        for street, line in near
        if street.tags.get("highway") in _WITH_SIDEWALKS
        and not any(key.startswith("sidewalk") for key in street.tags)
    ]
    if not lacking:
        return
    shapes = [
        one
        for one in near_drives(structures, drives)
        if one.structure.semantic_class in ("building", "road", "sidewalk")
        or one.kind.startswith("Water")
    ]
    lanes = [line.buffer(street.width / 2.0, 4) for street, line in near]
    taken = np.concatenate([_triangles_from_above(shapes), lanes])
    # The union of a whole city takes long, so only polygons near each street
    # are used.
    tree = STRtree(taken)
    made: list[BaseGeometry] = []
    for street, line in lacking:
        strip = line.buffer(street.width / 2.0 + _SIDEWALK, 4)
        others = [
            *taken[tree.query(strip, "intersects")],
            *(area for area in made if area.intersects(strip)),
        ]
        covered = shapely.union_all(others, grid_size=_GRID)
        area = _cut(strip, covered)
        made.append(area)
        surface = [
            flat_surface(part, KERB_HEIGHT, street.name, ImportFaults())
            for part in parts_of(area)
            if not part.buffer(-0.3).is_empty
        ]
        if surface:
            laid = np.concatenate(surface)
            yield _paved_structure(f"sidewalk_{street.name}", "sidewalk", laid)


def _paved_structure(
    name: str, semantic_class: str, surface: np.ndarray
) -> Imported:
    """Returns a road or a sidewalk made of triangles (N, 3, 3) [m]."""
    kind = semantic_class.capitalize()
    return make_imported(name, semantic_class, kind, {"surface": surface}, {})


def _polygons_only(geometry: BaseGeometry) -> MultiPolygon:
    """Returns the polygons of a geometry, without its lines and points."""
    return MultiPolygon(list(parts_of(geometry)))


def _cut(area: BaseGeometry, other: BaseGeometry) -> MultiPolygon:
    """Returns the polygons of an area outside of another area."""
    return _polygons_only(shapely.difference(area, other, grid_size=_GRID))


# Half the width of a street of unknown width [m].
HALF_STREET = 3.9
# A carriageway ends this far from walls [m].
_FROM_WALL = 0.5
# Sidewalks narrower than this are left out [m].
_NARROWEST_SIDEWALK = 0.6
# A carriageway is this far above the ground that it covers [m].
_ABOVE = 0.02


def guessed_streets(
    structures: Sequence[Imported],
    drives: Sequence[WaypointRoute],
    ground: Ground,
) -> Iterator[Imported]:
    """Yields structures for a carriageway and sidewalks along drives.

    Use this function for a city whose file has no roads: the drives are assumed
    to be in the middle of the streets.
    """
    paths = MultiLineString([drive.path for drive in drives]).simplify(0.05)
    near = near_drives(structures, drives)
    houses = [o for o in near if o.structure.semantic_class == "building"]
    roofs = _triangles_from_above(houses, with_downward=False)
    reach = paths.buffer(HALF_STREET + _SIDEWALK + _FROM_WALL)
    shapely.prepare(reach)
    roofs = roofs[shapely.intersects(reach, roofs)]
    walls = shapely.union_all(roofs, grid_size=_GRID)
    street = _cut(paths.buffer(HALF_STREET, 4), walls.buffer(_FROM_WALL, 1))
    beside = _cut(paths.buffer(HALF_STREET + _SIDEWALK, 4), street)
    beside = _cut(beside, walls)
    half = _NARROWEST_SIDEWALK / 2.0
    wide = beside.buffer(-half, 2).buffer(half, 2)
    sidewalks = wide.intersection(beside)
    terrain = (one for one in structures if one.kind == "TINRelief")
    below = turned_up(joined(one.triangles for one in terrain))
    if not len(below):
        mesh = ground.to_mesh()
        below = mesh.vertices[mesh.triangles()]
        heights = ground.height(below.reshape(-1, 3)[:, :2])
        below[..., 2] = heights.reshape(below.shape[:2])
    below = below[looks_up(below)]
    outlines = np.asarray(shapely.polygons(below[:, [0, 1, 2, 0], :2]))
    tree = shapely.STRtree(outlines)
    for name, semantic_class, area, above in (
        ("carriageway", "road", street, _ABOVE),
        ("sidewalk", "sidewalk", sidewalks, KERB_HEIGHT),
    ):
        for number, part in enumerate(parts_of(area)):
            hit = np.sort(tree.query(part, "intersects"))
            surface = _drape(part, below[hit], outlines[hit], above)
            if len(surface):
                yield _paved_structure(
                    f"{name}_{number}", semantic_class, surface
                )


def _drape(
    area: BaseGeometry, ground: np.ndarray, outlines: np.ndarray, above: float
) -> np.ndarray:
    """Returns an area laid above a ground, as triangles (N, 3, 3) [m].

    The triangles (M, 3, 3) of the ground look upwards and meet the area.
    `outlines` (M,) are these triangles seen from above.
    """
    pieces = shapely.intersection(outlines, area, grid_size=_GRID)
    found = [np.zeros((0, 3, 3))]
    for triangle, piece in zip(ground, pieces, strict=True):
        a, b, c = triangle
        normal = np.cross(b - a, c - a)
        for part in parts_of(piece):
            flat = flat_surface(part, 0.0, "street", ImportFaults())
            aside = (flat - a)[..., :2] @ normal[:2]
            flat[..., 2] = a[2] - aside / normal[2] + above
            found.append(flat)
    return np.concatenate(found)


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


def paved_gaps(
    structures: Sequence[Imported], drives: Sequence[WaypointRoute]
) -> Iterator[Imported]:
    """Yields sidewalks that fill gaps beside existing sidewalks.

    A gap is unpaved ground at most 3 m wide, such as the strip between a
    sidewalk and a building. Only gaps near the drives are filled. The ground
    must be level.
    """
    near = near_drives(
        [one for one in structures if one.kind != "Tree"], drives
    )
    walks = [_flat_outline(one) for one in near if one.kind == "Sidewalk"]
    if not walks:
        return
    roads = [_flat_outline(one) for one in near if one.kind == "Road"]
    walks_tree = STRtree(walks)
    houses = [one for one in near if one.structure.semantic_class == "building"]
    roofs = _triangles_from_above(houses)
    beside = walks_tree.query(roofs, "dwithin", _WIDEST_GAP)[0]
    covered = shapely.union_all([*walks, *roads, *roofs[np.unique(beside)]])
    half = _WIDEST_GAP / 2.0
    closed = covered.buffer(half, 2).buffer(-half, 2)
    gaps = shapely.difference(closed, covered, grid_size=_GRID)
    other = _triangles_from_above(
        [
            one
            for one in near
            if one.kind not in ("Sidewalk", "Road", "Crossing")
            and one not in houses
        ]
    )
    other_tree = STRtree(other)
    surfaces: dict[tuple[int, int], list[np.ndarray]] = {}
    for part in parts_of(gaps):
        if (
            part.area < _SMALLEST_GAP
            or not walks_tree.query(part, "dwithin", _GAP_WITHIN).size
        ):
            continue
        taken = shapely.union_all(
            other[other_tree.query(part, "intersects")], grid_size=_GRID
        )
        free = _cut(part, taken)
        inside = free.buffer(-_NARROWEST_GAP / 2.0, 2)
        wide = _polygons_only(inside.buffer(_NARROWEST_GAP / 2.0, 2))
        open_ = shapely.intersection(wide, free, grid_size=_GRID)
        square = (
            int(part.centroid.x // _SQUARE),
            int(part.centroid.y // _SQUARE),
        )
        surfaces.setdefault(square, []).extend(
            flat_surface(one, KERB_HEIGHT, "gap", ImportFaults())
            for one in parts_of(open_)
        )
    found = [some for some in surfaces.values() if some]
    for number, some in enumerate(found):
        surface = np.concatenate(some)
        yield _paved_structure(f"sidewalk_gap_{number}", "sidewalk", surface)


def _triangles_from_above(
    structures: Sequence[Imported], *, with_downward: bool = True
) -> np.ndarray:
    """Returns triangles of structures as polygons (N,), seen from above [m].

    Vertical triangles are left out. Unless `with_downward` is true, which is
    the default, so are triangles that look downwards.
    """
    triangles = joined(one.triangles for one in structures)
    if with_downward:
        triangles = turned_up(triangles)
    rings = np.round(triangles[looks_up(triangles)][:, [0, 1, 2, 0], :2], 3)
    return np.asarray(shapely.polygons(rings))


def _flat_outline(one: Imported) -> BaseGeometry:
    """Returns the area of a level structure, seen from above."""
    return shapely.coverage_union_all(_triangles_from_above([one]))
