"""Plants at other sizes, such as trees when they were younger."""

from dataclasses import replace
from typing import Any

import numpy as np

from cns_drake.city.geometry import (
    BoxShape,
    MeshShape,
    Model,
    Part,
    part_mesh,
    triple,
)


def younger_plant(model: Model, height: float) -> Model:
    """Returns a plant scaled down to a height above z = 0 [m].

    A plant that is not higher than this is returned unchanged.
    """
    meshes = (part_mesh(part, model.meshes) for part in model.parts)
    top = max(mesh.vertices[:, 2].max() for mesh in meshes)
    if top <= height:
        return model
    return scaled_plant(model, round(height / float(top), 4))


def scaled_plant(model: Model, factor: float) -> Model:
    """Returns a plant scaled about its origin by a factor."""

    def times(values: tuple[float, ...], digits: int) -> list[float]:
        return np.round(np.multiply(values, factor), digits).tolist()

    def scaled(part: Part) -> Part:
        shape: Any = part.shape
        if isinstance(shape, MeshShape):
            shape = replace(shape, scale=triple(times(shape.scale, 5)))
        elif isinstance(shape, BoxShape):
            shape = BoxShape(triple(times(shape.size, 5)))
        else:
            sizes = {k: round(v * factor, 4) for k, v in vars(shape).items()}
            shape = replace(shape, **sizes)
        return replace(part, shape=shape, xyz=triple(times(part.xyz, 4)))

    return replace(model, parts=tuple(map(scaled, model.parts)))
