"""Reads the geometries of CityJSON objects, also those made from templates."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from cns_drake.imports.cityjson.city_file import CityGeometry, Face
from cns_drake.imports.cityjson.reference_systems import ReferenceSystem
from cns_drake.imports.cityjson.vertices import FARTHEST, to_triples
from cns_drake.imports.faults import ImportFaults

# Type of a geometry -> depth of the lists that contain its faces.
_NESTING = {
    "MultiSurface": 0,
    "CompositeSurface": 0,
    "Solid": 1,
    "MultiSolid": 2,
    "CompositeSolid": 2,
}


class Templates:
    """Geometry templates of a file, which objects place in the world.

    Attributes:
        vertices: (N, 3) vertices of the document that is being read [m]. The
            caller sets them for each document.
        system: reference system of the templates.
    """

    def __init__(self, whole: dict, where: str):
        """Takes the templates in a document of type CityJSON.

        `where` names the file and the line of the document in error messages.

        Raises:
            InputError: the vertices of the templates cannot be used.
        """
        templates = whole.get("geometry-templates")
        templates = templates if isinstance(templates, dict) else {}
        self._geometries = templates.get("templates") or []
        self._points = to_triples(
            templates.get("vertices-templates", []),
            f"{where}: geometry-templates.vertices-templates",
        )
        self.vertices = np.zeros((0, 3))
        self.system = ReferenceSystem()

    def place(self, instance: dict) -> tuple[Any, np.ndarray]:
        """Returns an instance's template, and the vertices of the instance.

        The vertices (N, 3) are the template's vertices, transformed to the
        place of the instance [m].

        Args:
            instance: geometry of the type `GeometryInstance`, which refers to a
                template and a transformation.

        Raises:
            LookupError, TypeError, ValueError: if the instance is faulty.
        """
        template = self._geometries[instance["template"]]
        (reference,) = instance["boundaries"]
        X = np.array(instance["transformationMatrix"], dtype=np.float64)
        X = X.reshape(4, 4)
        with np.errstate(over="ignore", invalid="ignore"):
            placed = self._points @ X[:3, :3].T + X[:3, 3]
        is_affine = (X[3] == [0.0, 0.0, 0.0, 1.0]).all()
        if reference < 0 or not is_affine:
            raise ValueError
        if not (np.abs(placed) <= FARTHEST).all():
            raise ValueError
        return template, (
            self.system.to_metres(placed) + self.vertices[reference]
        )


def read_geometry(
    geometry: Any, templates: Templates, name: str, faults: ImportFaults
) -> CityGeometry | None:
    """Returns a geometry of an object; None if the geometry cannot be read.

    Args:
        geometry: the geometry in the file.
        templates: the templates, and the vertices to which indices refer.
        name: id of the object, as an example in `faults`.
        faults: counts geometries and faces that are left out.
    """
    vertices = templates.vertices
    try:
        lod = _level_of_detail(geometry.get("lod"))
        kind = geometry["type"]
        if kind == "GeometryInstance":
            geometry, vertices = templates.place(geometry)
            kind = geometry["type"]
            lod = lod or _level_of_detail(geometry.get("lod"))
        if kind not in _NESTING:
            faults.add(f"geometry of type {kind}, left out", name)
            return None
        boundaries = geometry["boundaries"]
        for _ in range(_NESTING[kind]):
            boundaries = [face for group in boundaries for face in group]
        kinds = _surface_kinds(
            geometry.get("semantics"), _NESTING[kind], len(boundaries)
        )
    except (LookupError, TypeError, ValueError, AttributeError):
        faults.add("geometry that is not an object, left out", name)
        return None
    faces, kept = [], []
    for boundary, one in zip(boundaries, kinds, strict=True):
        face = _face_of_boundary(boundary, vertices)
        if face is None:
            faults.add("face with unknown vertices, left out", name)
        else:
            faces.append(face)
            kept.append(one)
    return CityGeometry(lod, faces, kept, _NESTING[kind] > 0)


def _level_of_detail(value: object) -> float:
    return float(str(value)) if value is not None else 0.0


def _face_of_boundary(boundary: Any, vertices: np.ndarray) -> Face | None:
    """Returns a face; None if an index belongs to no vertex."""
    face = []
    try:
        for ring in boundary:
            indices = np.array(ring)
            if len(indices) == 0:
                continue
            if indices.dtype.kind != "i" or indices.ndim != 1:
                return None
            if indices.min() < 0 or indices.max() >= len(vertices):
                return None
            face.append(vertices[indices])
    except (TypeError, ValueError):
        return None
    return face or None


def _surface_kinds(semantics: Any, nesting: int, number: int) -> Sequence[str]:
    """Returns the types of `number` faces; "" for an unknown type."""
    unknown = [""] * number
    if not isinstance(semantics, dict):
        return unknown
    values, surfaces = semantics.get("values"), semantics.get("surfaces")
    for _ in range(nesting):
        if not isinstance(values, list) or None in values:
            return unknown
        values = [one for group in values for one in group]
    if not isinstance(values, list) or len(values) != number:
        return unknown
    if not isinstance(surfaces, list):
        return unknown
    return [
        ""
        if value is None or not 0 <= value < len(surfaces)
        else str(surfaces[value].get("type", ""))
        for value in values
    ]
