"""Kerbs along the edges of imported sidewalks."""

from dataclasses import replace

import numpy as np

from cns_drake.city.geometry import Mesh, MeshShape, Part, turned_up
from cns_drake.imports.colours import Rgb
from cns_drake.imports.imported_objects import ImportedObject

# The sides of a kerb reach this far down from its upper edges [m].
_KERB_DEPTH = 0.25
# Colour of kerbs.
_KERB_RGB: Rgb = (0.60, 0.60, 0.58)
# Millimetres in a metre: corners that are equal in whole millimetres are one.
_MM = 1000.0


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
