"""Polyhedra in place of the round parts of small objects."""

from dataclasses import replace

import numpy as np

from cns_drake.base.round_shapes import revolved
from cns_drake.city.geometry import (
    CylinderShape,
    Mesh,
    MeshShape,
    Model,
    SphereShape,
)

# Number of sides of posts and balls.
_SIDES = 8
# Number of sides of discs. Discs such as signs must not look like octagons.
_SIDES_OF_DISC = 20
# Names of the meshes.
_POST = "round_post"
_DISC = "round_disc"
_BALL = "round_ball"


def without_curves(model: Model) -> Model:
    """Returns a model with polyhedra in place of cylinders and spheres.

    A polyhedron has the same cross-section area as the shape that it replaces.
    """
    parts = []
    meshes = dict(model.meshes)
    for part in model.parts:
        shape = part.shape
        if isinstance(shape, CylinderShape):
            r = shape.radius
            is_disc = shape.length < shape.radius
            name = _DISC if is_disc else _POST
            sides = _SIDES_OF_DISC if is_disc else _SIDES
            scaled = MeshShape(name, (r, r, shape.length))
            part = replace(part, shape=scaled)
            meshes[name] = _revolved([1.0], [0.5], sides)
        elif isinstance(shape, SphereShape):
            r = shape.radius
            part = replace(part, shape=MeshShape(_BALL, (r, r, r)))
            # The circles are at latitudes of 90, 45 and 0 deg.
            half = np.sqrt(0.5)
            meshes[_BALL] = _revolved(
                [0.0, half, 1.0], [1.0, half, 0.0], _SIDES
            )
        parts.append(part)
    return replace(model, parts=tuple(parts), meshes=meshes)


def _revolved(radius: list[float], z: list[float], sides: int) -> Mesh:
    """Returns a solid of revolution with polygons of the circles' areas.

    `z` is as for `revolved`, and `radius` contains the radii of the circles.
    """
    step = 2.0 * np.pi / sides
    wide = np.sqrt(step / np.sin(step)) * np.array(radius)
    vertices, triangles = revolved(wide, np.array(z), sides)
    return Mesh(vertices, tuple(map(tuple, triangles.tolist())))
