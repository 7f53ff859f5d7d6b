"""Crops an imported city to the structures near its drives."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry import MultiLineString
from shapely.geometry.base import BaseGeometry

from cns_drake.base.errors import InputError
from cns_drake.city.geometry import Mesh, MeshShape
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.faults import ImportFaults
from cns_drake.imports.imported_objects import ImportedObject
from cns_drake.imports.staged_city import StagedCity


def cropped_city(
    city: StagedCity,
    drives: Sequence[WaypointRoute],
    distance: float,
    faults: ImportFaults,
) -> StagedCity:
    """Returns a city without structures far from drives.

    A structure is kept if its bounding box is within `distance` [m] of a drive;
    all other structures are counted in `faults`. Terrain is cut to the part
    near the drives.

    Raises:
        InputError: no structure is near a drive, or there is no drive.
    """
    if not drives:
        raise InputError("--within: no drive was found; give one with --along")
    paths = MultiLineString([drive.path for drive in drives])
    shapely.prepare(paths)
    changed: dict[ImportedObject, ImportedObject | None] = {}
    for kept in city.kept:
        corners = kept.triangles.reshape(-1, 3)
        if not _are_near(corners[None], paths, distance)[0]:
            name = kept.structure.name
            faults.add("structure far from the drives, left out", name)
            changed[kept] = None
        elif kept.object_type == "TINRelief":
            changed[kept] = _cropped_terrain(kept, paths, distance)
    cropped = city.replaced(changed)
    if not cropped.kept:
        raise InputError(
            f"--within: nothing stands within {distance:g} m of the drives"
        )
    return cropped


def _are_near(
    corners: np.ndarray, paths: BaseGeometry, distance: float
) -> np.ndarray:
    """Returns (M,) bool: whether bounding boxes are near paths.

    `corners` (M, N, 3) contains the N corners of the surface in each box [m].
    """
    low, high = corners[:, :, :2].min(axis=1), corners[:, :, :2].max(axis=1)
    boxes = shapely.box(*low.T, *high.T)
    return np.asarray(shapely.dwithin(boxes, paths, distance))


def _cropped_terrain(
    terrain: ImportedObject, paths: BaseGeometry, distance: float
) -> ImportedObject:
    """Returns the part of a terrain that is within `distance` of paths [m].

    Meshes are cut by whole triangles. Parts of another shape, which no format
    has for terrain, are kept as they are.
    """
    model = terrain.structure.model
    meshes = {}
    for name, mesh in model.meshes.items():
        faces = mesh.triangles()
        near = faces[_are_near(mesh.vertices[faces], paths, distance)]
        used, index = np.unique(near, return_inverse=True)
        corners = map(tuple, index.reshape(-1, 3).tolist())
        meshes[name] = Mesh(mesh.vertices[used], tuple(corners))
    parts = tuple(
        part
        for part in model.parts
        if not isinstance(part.shape, MeshShape)
        or meshes[part.shape.mesh].faces
    )
    filled = {name: mesh for name, mesh in meshes.items() if mesh.faces}
    structure = replace(
        terrain.structure, model=replace(model, parts=parts, meshes=filled)
    )
    triangles = terrain.triangles
    triangles = triangles[_are_near(triangles, paths, distance)]
    return replace(terrain, structure=structure, triangles=triangles)
