"""The ground of a dressed city: kerbs, missing sidewalks, paved courts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry import LineString, MultiLineString, MultiPolygon
from shapely.geometry.base import BaseGeometry

from cns_drake.city.facades.assembly import Rgb
from cns_drake.city.geometry.mesh import Mesh
from cns_drake.city.geometry.structures import (
    MeshShape,
    Part,
    Structure,
)
from cns_drake.imports.dressing.upper_sides import looks_up, turned_up
from cns_drake.imports.drives.search import WaypointDrive
from cns_drake.imports.faces import flat_surface, parts_of
from cns_drake.imports.foreign_city import Imported, Street, make_imported
from cns_drake.imports.options import ImportFaults

# Within this distance of drives, sidewalks get kerbs, and missing ones are
# added [m].
_WITHIN = 80.0
KERB_HEIGHT, _KERB_DEPTH = 0.12, 0.25
_KERB: Rgb = (0.60, 0.60, 0.58)
_PAVED: Rgb = (0.57, 0.56, 0.53)
_SIDEWALK = 2.0
# Streets of these kinds have sidewalks if their tags give no answer.
_WITH_SIDEWALKS = (
    "primary",
    "secondary",
    "tertiary",
    "unclassified",
    "residential",
)
# If buildings cover at least this part of a city's area, ground of unknown kind
# is paved.
_DENSE = 0.12
_MM = 1000.0


def is_dense(structures: Sequence[Imported]) -> bool:
    """Returns whether buildings cover much of their city."""
    outlines = [
        one.structure.model.footprint
        for one in structures
        if one.kind.startswith("Building")
    ]
    if not outlines:
        return False
    whole = shapely.union_all(outlines)
    return bool(whole.area >= _DENSE * whole.convex_hull.area)


def paved(structure: Structure) -> Structure:
    """Returns a ground in the colour of stones."""
    model = structure.model
    parts = tuple(replace(part, rgb=_PAVED) for part in model.parts)
    return replace(structure, model=replace(model, parts=parts))


def with_kerb(one: Imported) -> Imported:
    """Returns a sidewalk with an upright edge all around."""
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
            Part("kerb", MeshShape(name), rgb=_KERB),
        ),
        meshes={**structure.model.meshes, name: mesh},
    )
    return replace(one, structure=replace(structure, model=model))


def _outer_edges(triangles: np.ndarray) -> np.ndarray:
    """Returns the edges (N, 2, 3) that only one triangle (M, 3, 3) has."""
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


def near_drives(
    structures: Sequence[Imported], drives: Sequence[WaypointDrive]
) -> list[Imported]:
    """Returns the structures near drives."""
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
    drives: Sequence[WaypointDrive],
) -> Iterator[Imported]:
    """Yields sidewalks of streets near drives whose tags do not mention any.

    Args:
        structures: those of all stages, on level ground.
        streets: of the file.
        drives: through the city.
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
        turned_up(one.triangles)[looks_up(turned_up(one.triangles))]
        for one in near_drives(structures, drives)
        if one.structure.semantic_class in ("building", "road", "sidewalk")
        or one.kind.startswith("Water")
    ]
    triangles = np.concatenate([np.zeros((0, 3, 3)), *shapes])
    rings = np.round(triangles[:, [0, 1, 2, 0], :2], 3)
    lanes = [line.buffer(street.width / 2.0, 4) for street, line in near]
    taken = np.concatenate([shapely.polygons(rings), lanes])
    # The union of a whole city takes long: only polygons near each street
    # count.
    tree = STRtree(taken)
    made: list[BaseGeometry] = []
    for street, line in lacking:
        strip = line.buffer(street.width / 2.0 + _SIDEWALK, 4)
        others = [
            *taken[tree.query(strip, "intersects")],
            *(area for area in made if area.intersects(strip)),
        ]
        covered = shapely.union_all(others, grid_size=1.0 / _MM)
        area = areas_of(shapely.difference(strip, covered, grid_size=1.0 / _MM))
        made.append(area)
        surface = [
            flat_surface(part, KERB_HEIGHT, street.name, ImportFaults())
            for part in parts_of(area)
            if not part.buffer(-0.3).is_empty
        ]
        if surface:
            yield make_imported(
                f"sidewalk_{street.name}",
                "sidewalk",
                "Sidewalk",
                {"surface": np.concatenate(surface)},
                {},
            )


def areas_of(geometry: BaseGeometry) -> MultiPolygon:
    """Returns the polygons of a geometry, without its lines and points."""
    return MultiPolygon(list(parts_of(geometry)))
