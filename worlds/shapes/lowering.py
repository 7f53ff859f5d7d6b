"""Makes earlier versions of a building, which lack its upper storeys.

The part below the new height stays unchanged, to the millimetre, so that the
street front looks the same. The building gets a new roof.
"""

from collections.abc import Sequence
import math

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon, box
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from worlds.shapes.assembly import Assembly
from worlds.shapes.mesh import Mesh
from worlds.shapes.models import Finish, MeshShape, Model, Part, part_mesh
from worlds.shapes.polygon_meshes import surface_mesh, wall_mesh
from worlds.shapes.polygons import polygons_of, snap
from worlds.shapes.roof_equipment import equip_roof
from worlds.shapes.site import Site

# Walls and the glass behind them count as one if they are this close [m].
_REVEAL = 0.7
# Pieces of wall that happen to end at the height, and are smaller than this,
# get no roof [m^2].
_LEAST_ROOF = 4.0
# Corners have coordinates in whole millimetres. A cut this far above meets none
# [m].
_BETWEEN = 0.0005
# A part that rises less than this above the height is no storey [m].
STOREY = 2.5
_PARAPET = 0.9
_PARAPET_WIDTH = 0.3
# The band that closes the walls starts this far below the roof [m].
_BAND = 0.5
# The band sticks out of the walls by this [m].
_BAND_REACH = 0.04
_ROOF_ITEMS = ("stair_house", "ac_unit", "vents", "skylight")
_Point = list[float]


def lowered(model: Model, height: float, name: str, seed: int) -> Model:
    """Returns a building cut off at a height, with a new flat roof.

    The model is returned unchanged if less than a storey lies above `height`,
    or if its walls enclose no area at this height.

    Args:
        model: the building.
        height: height of the new roof above the building's ground [m]; the
            parapet and the roof equipment reach higher.
        name: beginning of the names of new meshes.
        seed: seed of the random roof equipment.
    """
    if top_of(model) < height + STOREY:
        return model
    placed = [(part, part_mesh(part, model.meshes)) for part in model.parts]
    ground = box(*model.footprint.bounds)
    site = Site(ground, f"{name}_at_{round(10 * height)}")
    assembly = Assembly(site, np.random.default_rng(seed), _wall_finish(placed))
    parts: list[Part] = []
    edges: list[np.ndarray] = []
    for part, mesh in placed:
        low, high = mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()
        if high <= height:
            parts.append(part)
        elif low < height and not _is_shared(part):
            below, cut = cut_at(mesh, height + _BETWEEN)
            edges.append(cut)
            if below.faces:
                shape = MeshShape(assembly.define(part.name, below))
                below_part = Part(
                    part.name, shape, rgb=part.rgb, material=part.material
                )
                parts.append(below_part)
    plan = enclosed(np.concatenate([np.zeros((0, 2, 2)), *edges]))
    if plan.is_empty:
        return model
    _add_roof(assembly, plan, height)
    used = {p.shape.mesh for p in parts if isinstance(p.shape, MeshShape)}
    meshes = {key: m for key, m in model.meshes.items() if key in used}
    return Model(
        (*parts, *assembly.parts),
        {**meshes, **assembly.meshes},
        model.footprint,
    )


def top_of(model: Model) -> float:
    """Returns the height of a building's top, without roof equipment [m].

    The height is -inf if the model contains only roof equipment.
    """
    return max(
        (
            float(part_mesh(part, model.meshes).vertices[:, 2].max())
            for part in model.parts
            if not _is_shared(part)
        ),
        default=-math.inf,
    )


def cut_at(mesh: Mesh, height: float) -> tuple[Mesh, np.ndarray]:
    """Cuts a mesh at a height; returns its lower part and the edges of the cut.

    The lower part is open at the cut.

    Args:
        mesh: a mesh with plane, convex faces.
        height: height of the cut [m].

    Returns:
        The lower part, and start and end of the edges, (N, 2, 2) [m]. Each edge
        is the line along which one face is cut. Seen from above, the back of
        the face is on the left of the edge.
    """
    corners: list[_Point] = []
    faces: list[tuple[int, ...]] = []
    edges = []
    # Python numbers, because NumPy is slow for arrays of a few.
    vertices = mesh.vertices.tolist()
    for face in mesh.faces:
        ring = [vertices[k] for k in face]
        heights = [z for _, _, z in ring]
        if min(heights) > height:
            continue
        if max(heights) > height:
            normal = _normal_of(ring)
            ring, crossing = _clip_face(ring, height)
            if len(crossing) == 2:
                (x0, y0), (x1, y1) = crossing
                # The inside of a wall is on the left of an edge whose face
                # looks to the right.
                right = (y1 - y0) * normal[0] - (x1 - x0) * normal[1]
                edges.append(crossing if right > 0 else crossing[::-1])
        # The lower part of a quadrilateral may have five corners.
        while len(ring) >= 3:
            piece = ring[:4]
            ring = [ring[0], *ring[3:]]
            faces.append(tuple(range(len(corners), len(corners) + len(piece))))
            corners.extend(piece)
    below = Mesh(np.array(corners, dtype=float).reshape(-1, 3), tuple(faces))
    return below, np.array(edges).reshape(-1, 2, 2)


def _normal_of(ring: list[_Point]) -> tuple[float, float]:
    """Returns x and y of a face's normal, not normalised."""
    (x0, y0, z0), (x1, y1, z1), (x2, y2, z2) = ring[:3]
    return (
        (y1 - y0) * (z2 - z0) - (z1 - z0) * (y2 - y0),
        (z1 - z0) * (x2 - x0) - (x1 - x0) * (z2 - z0),
    )


def _clip_face(
    ring: list[_Point], height: float
) -> tuple[list[_Point], list[list[float]]]:
    """Returns the part of a face below a height, and the edges of the cut."""
    kept, crossing = [], []
    for p, q in zip(ring, [*ring[1:], ring[0]], strict=True):
        if p[2] <= height:
            kept.append(p)
        if (p[2] - height) * (q[2] - height) < 0:
            share = (height - p[2]) / (q[2] - p[2])
            cut = [p[k] + share * (q[k] - p[k]) for k in range(2)]
            kept.append([*cut, height])
            crossing.append(cut)
    return kept, crossing


def enclosed(edges: np.ndarray) -> MultiPolygon:
    """Returns the area that a building's walls enclose at a height [m].

    Courtyards are holes in the area. `edges` (N, 2, 2) contains start and end
    of the edges along which `cut_at` cuts the walls [m]; the area is on their
    left. Niches in the walls, and gaps between walls and objects in front of
    these walls, count as enclosed. Coordinates of the area are whole
    millimetres.
    """
    edges = edges[np.ptp(edges, axis=1).max(axis=1) > 0.001]
    lines = shapely.linestrings(edges)
    walls = unary_union(shapely.buffer(lines, _REVEAL, cap_style="square"))
    plan: BaseGeometry = MultiPolygon()
    # Sorted from the outside inwards: courtyards lie inside their buildings.
    rings = [(Polygon(one.exterior), one) for one in polygons_of(walls)]
    for outer, ring in sorted(
        rings, key=lambda r: round(r[0].area, 6), reverse=True
    ):
        mine = edges[shapely.intersects(lines, ring)]
        a, b = (mine - mine.mean(axis=(0, 1))).transpose(1, 0, 2)
        # The outer edges of a building run counter-clockwise, and the edges
        # of a courtyard clockwise.
        if (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() > 0:
            plan = plan.union(_grown_area(outer, -_REVEAL))
        else:
            holes = [Polygon(hole) for hole in ring.interiors]
            yard = _grown_area(unary_union(holes), _REVEAL)
            plan = plan.difference(yard)
    return MultiPolygon(
        [
            piece
            for piece in polygons_of(snap(plan.simplify(0.05)))
            if piece.area > _LEAST_ROOF
        ]
    )


def _grown_area(area: BaseGeometry, distance: float) -> BaseGeometry:
    """Returns an area grown by a distance [m], with its corners kept sharp."""
    # For edges on one line, GEOS divides by zero on its way to a valid result.
    with np.errstate(divide="ignore", invalid="ignore"):
        return area.buffer(distance, join_style="mitre")


def _add_roof(assembly: Assembly, plan: MultiPolygon, height: float) -> None:
    """Closes the walls with a band, a parapet and a flat roof."""
    top = round(height + _PARAPET, 3)
    outer = snap(_grown_area(plan, _BAND_REACH))
    inner = snap(_grown_area(plan, -_PARAPET_WIDTH))
    assembly.add(
        "new_roof",
        # The wall is seen from outside, not from within.
        wall_mesh(outer, height - _BAND, top).inside_out(),
        surface_mesh(outer.difference(inner), top),
        wall_mesh(inner, height, top),
        surface_mesh(inner, height),
    )
    for number, piece in enumerate(polygons_of(inner)):
        ring = np.array(shapely.orient_polygons(piece).exterior.coords[:-1])
        equip_roof(assembly, ring, height, _ROOF_ITEMS, prefix=f"new_{number}_")


def _is_shared(part: Part) -> bool:
    """Returns whether a part is equipment, whose mesh other buildings share."""
    shape = part.shape
    return isinstance(shape, MeshShape) and shape.mesh.startswith("roof_")


def _wall_finish(placed: Sequence[tuple[Part, Mesh]]) -> Finish:
    """Returns the finish of the building's largest part that is not glass."""

    def extent(one: tuple[Part, Mesh]) -> float:
        return round(float(np.prod(np.ptp(one[1].vertices, axis=0))), 6)

    walls = [one for one in placed if one[0].material != "glass"]
    largest, _ = max(walls, key=extent)
    return Finish(largest.rgb, largest.material)
