"""Round parts of small things as triangles.

Rays that come near a curved shape are cast twice, which a city of triangles
alone is spared.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cns_drake.city.geometry.mesh import Mesh
from cns_drake.city.geometry.structures import (
    CylinderShape,
    MeshShape,
    Model,
    Part,
    SphereShape,
)

# Sides of posts and balls; discs, such as signs, must differ from octagons.
_SIDES, _SIDES_OF_DISC = 8, 20
_POST, _DISC, _BALL = "round_post", "round_disc", "round_ball"


def without_curves(model: Model) -> Model:
    """Returns a model with prisms and polyhedra for cylinders and spheres.

    Their cross-sections have the same areas.
    """
    parts, meshes = [], dict(model.meshes)
    for part in model.parts:
        shape = part.shape
        if isinstance(shape, CylinderShape):
            r, is_disc = shape.radius, shape.length < shape.radius
            name = _DISC if is_disc else _POST
            sides = _SIDES_OF_DISC if is_disc else _SIDES
            part = _with_mesh(part, name, (r, r, shape.length))
            meshes[name] = _turned((1.0, 1.0), (-0.5, 0.5), sides)
        elif isinstance(shape, SphereShape):
            part = _with_mesh(part, _BALL, (shape.radius,) * 3)
            low = np.sqrt(0.5)
            meshes[_BALL] = _turned(
                (low, 1.0, low), (-low, 0.0, low), _SIDES, 1.0
            )
        parts.append(part)
    return replace(model, parts=tuple(parts), meshes=meshes)


def _with_mesh(part: Part, name: str, scale: tuple[float, ...]) -> Part:
    x, y, z = scale
    return replace(part, shape=MeshShape(name, (x, y, z)))


def _turned(
    radii: tuple[float, ...],
    heights: tuple[float, ...],
    sides: int,
    pole: float | None = None,
) -> Mesh:
    """Returns a profile turned about z.

    Args:
        radii: from below.
        heights: at these radii.
        sides: of the polygon, which has the area of the circle.
        pole: where the axis is met, above and below; at the same heights as
            the first and the last radius if None.
    """
    step = 2.0 * np.pi / sides
    angle = step * np.arange(sides)
    circle = np.sqrt(step / np.sin(step)) * np.column_stack(
        [np.cos(angle), np.sin(angle)]
    )
    rings = [
        np.column_stack([r * circle, np.full(sides, z)])
        for r, z in zip(radii, heights, strict=True)
    ]
    low, high = (heights[0], heights[-1]) if pole is None else (-pole, pole)
    vertices = np.concatenate([[(0.0, 0.0, low)], *rings, [(0.0, 0.0, high)]])
    top = len(vertices) - 1
    last = top - sides
    faces: list[tuple[int, ...]] = []
    for k in range(sides):
        n = (k + 1) % sides
        faces += [(0, 1 + n, 1 + k), (top, last + k, last + n)]
        for start in range(1, last, sides):
            above = start + sides
            faces.append((start + k, start + n, above + n, above + k))
    return Mesh(vertices, tuple(faces))
