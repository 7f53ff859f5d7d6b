"""Structures near drives: the part of a city that a LiDAR can see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import MultiLineString
from shapely.geometry.base import BaseGeometry

from cns_drake.base.errors import InputError
from cns_drake.city.geometry.mesh import Mesh
from cns_drake.city.geometry.structures import MeshShape
from cns_drake.imports.foreign_city import Imported
from cns_drake.imports.import_faults import ImportFaults
from cns_drake.imports.waypoint_drives import WaypointDrive, driven_path
from cns_drake.motion.control_points import POINT_SPACING
from cns_drake.roads.u_turn import TIGHTEST_RADIUS
from cns_drake.roads.waypoints import load_waypoint_path, read_waypoints


def drive_along(path: Path) -> WaypointDrive:
    """Returns a drive along waypoints of a file, without their heights.

    Raises:
        InputError: if the file cannot be used, or a bend is too tight.
    """
    points, _ = read_waypoints(path)
    control = load_waypoint_path(path, POINT_SPACING).points[:, :2]
    driven, radii = driven_path(control)
    radius, (x, y) = radii.min(), driven[radii.argmin()]
    if radius < TIGHTEST_RADIUS:
        raise InputError(
            f"{path}: a bend at {x:.1f}, {y:.1f} has a radius of {radius:.2f} "
            f"m; the car needs {TIGHTEST_RADIUS:.2f} m"
        )
    return WaypointDrive(points[:, :2], control)


def keep_near(
    structures: Sequence[Imported],
    drives: Sequence[WaypointDrive],
    distance: float,
    faults: ImportFaults,
) -> list[Imported | None]:
    """Returns the structures, and the part of the terrain, near drives.

    Other structures become None.

    Args:
        structures: of the city.
        drives: at least one.
        distance: greatest distance of a structure's nearest corner, or of its
            bounding box [m].
        faults: counts the structures left out.
    """
    ways = MultiLineString([drive.path for drive in drives])
    shapely.prepare(ways)
    kept: list[Imported | None] = []
    for one in structures:
        corners = one.triangles.reshape(-1, 3)
        if not _near(corners[None], ways, distance)[0]:
            name = one.structure.name
            faults.add("structure far from the drives, left out", name)
            kept.append(None)
        elif one.kind == "TINRelief":
            kept.append(_cropped(one, ways, distance))
        else:
            kept.append(one)
    return kept


def _near(
    things: np.ndarray, ways: BaseGeometry, distance: float
) -> np.ndarray:
    """Returns which of M things of N corners (M, N, 3) have a box nearby."""
    low, high = things[:, :, :2].min(axis=1), things[:, :, :2].max(axis=1)
    boxes = shapely.box(*low.T, *high.T)
    return np.asarray(shapely.dwithin(boxes, ways, distance))


def _cropped(one: Imported, ways: BaseGeometry, distance: float) -> Imported:
    """Returns the near part of a terrain, unchanged."""
    meshes = {}
    for name, mesh in one.structure.model.meshes.items():
        faces = mesh.triangles()
        near = faces[_near(mesh.vertices[faces], ways, distance)]
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
    near = _near(one.triangles, ways, distance)
    return replace(one, structure=structure, triangles=one.triangles[near])
