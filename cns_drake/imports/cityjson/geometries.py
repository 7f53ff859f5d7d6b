"""Reads the geometries of CityJSON objects, also those made from templates."""

from collections.abc import Sequence
from typing import Any, NamedTuple

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


class Templates(NamedTuple):
    """Geometry templates of a file, which objects place in the world.

    Attributes:
        geometries: the templates, as in the file.
        points: (N, 3) vertices of all templates, in coordinates of the file.
    """

    geometries: Sequence[Any] = ()
    points: np.ndarray = np.zeros((0, 3))


def read_templates(document: dict, where: str) -> Templates:
    """Returns the templates in a document of type CityJSON.

    `where` names the file and the line of the document in error messages.

    Raises:
        InputError: the vertices of the templates cannot be used.
    """
    templates = document.get("geometry-templates")
    templates = templates if isinstance(templates, dict) else {}
    points = to_triples(
        templates.get("vertices-templates", []),
        f"{where}: geometry-templates.vertices-templates",
    )
    return Templates(templates.get("templates") or [], points)


class GeometrySource(NamedTuple):
    """What the geometries of a document refer to.

    Attributes:
        vertices: (N, 3) vertices of the document [m].
        templates: templates of the file.
        system: reference system of the templates.
    """

    vertices: np.ndarray
    templates: Templates
    system: ReferenceSystem

    def instance(self, instance: dict) -> tuple[Any, np.ndarray]:
        """Returns an instance's template, and the vertices of the instance.

        The vertices (N, 3) are the template's vertices, transformed to the
        place of the instance [m].

        Args:
            instance: geometry of the type `GeometryInstance`, which refers to a
                template and a transformation.

        Raises:
            LookupError, TypeError, ValueError: if the instance is faulty.
        """
        template = self.templates.geometries[instance["template"]]
        (reference,) = instance["boundaries"]
        X = np.array(instance["transformationMatrix"], dtype=np.float64)
        X = X.reshape(4, 4)
        with np.errstate(over="ignore", invalid="ignore"):
            placed = self.templates.points @ X[:3, :3].T + X[:3, 3]
        is_affine = (X[3] == [0.0, 0.0, 0.0, 1.0]).all()
        if reference < 0 or not is_affine:
            raise ValueError
        if not (np.abs(placed) <= FARTHEST).all():
            raise ValueError
        return template, (
            self.system.to_metres(placed) + self.vertices[reference]
        )


def read_geometry(
    geometry: Any, source: GeometrySource, name: str, faults: ImportFaults
) -> CityGeometry | None:
    """Returns a geometry of an object; None if the geometry cannot be read.

    Args:
        geometry: the geometry in the file.
        source: the vertices and templates to which the geometry refers.
        name: id of the object, as an example in `faults`.
        faults: counts geometries and faces that are left out.
    """
    vertices = source.vertices
    try:
        lod = _level_of_detail(geometry.get("lod"))
        kind = geometry["type"]
        if kind == "GeometryInstance":
            geometry, vertices = source.instance(geometry)
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
    faces, kinds_of_faces = [], []
    for boundary, kind_of_face in zip(boundaries, kinds, strict=True):
        face = _face_of_boundary(boundary, vertices)
        if face is None:
            faults.add("face with unknown vertices, left out", name)
        else:
            faces.append(face)
            kinds_of_faces.append(kind_of_face)
    return CityGeometry(lod, faces, kinds_of_faces, _NESTING[kind] > 0)


def _level_of_detail(value: object) -> float:
    """Returns the level of detail that a geometry states; 0 if none."""
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
        values = [value for group in values for value in group]
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
