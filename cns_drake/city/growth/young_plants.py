"""A plant some years before it reached its size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cns_drake.city.geometry.object_parts import part_mesh
from cns_drake.city.geometry.structures import (
    BoxShape,
    CylinderShape,
    MeshShape,
    Model,
    Part,
    Shape,
    SphereShape,
)


def younger(model: Model, height: float) -> Model:
    """Returns a plant of a height, alike in all its proportions.

    Args:
        model: the grown plant, on z = 0.
        height: of its top [m].

    Returns:
        A plant with the same footprint; the model itself if it is lower.
    """
    top = max(
        part_mesh(part, model.meshes).vertices[:, 2].max()
        for part in model.parts
    )
    if top <= height:
        return model
    share = round(height / float(top), 4)
    parts = tuple(_scaled(part, share) for part in model.parts)
    return replace(model, parts=parts)


def _scaled(part: Part, share: float) -> Part:
    x, y, z = np.round(np.multiply(part.xyz, share), 4).tolist()
    return replace(part, shape=_scaled_shape(part.shape, share), xyz=(x, y, z))


def _scaled_shape(shape: Shape, share: float) -> Shape:
    def times(values: tuple[float, float, float]) -> tuple[float, float, float]:
        x, y, z = np.round(np.multiply(values, share), 5).tolist()
        return x, y, z

    if isinstance(shape, MeshShape):
        return MeshShape(shape.mesh, times(shape.scale))
    if isinstance(shape, BoxShape):
        return BoxShape(times(shape.size))
    if isinstance(shape, CylinderShape):
        radius, length = shape.radius * share, shape.length * share
        return CylinderShape(round(radius, 4), round(length, 4))
    return SphereShape(round(shape.radius * share, 4))
