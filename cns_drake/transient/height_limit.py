"""Lowers buildings and plants of a world, as if they had not yet grown."""

import numpy as np
from pydrake.math import RigidTransform

from cns_drake.scene import ScenePart, SceneStructure, tessellate
from cns_drake.transient.effect import Effect, Phase
from cns_drake.transient.surroundings import Surroundings, change_rng
from worlds.shapes import (
    OBJECT_MESHES,
    STOREY,
    Mesh,
    MeshShape,
    Model,
    Part,
    hull_of,
    lowered,
    top_of,
)

# Cause of these changes in the structure table.
_CAUSE = "height_limit"


def limit_heights(around: Surroundings, limit: float) -> None:
    """Lowers all buildings and plants that are higher than a limit.

    A building is cut off at the limit, and gets a flat roof with new equipment;
    it stays as it is if less than a storey lies above the limit. A plant is
    scaled down to the limit.

    Args:
        around: surroundings of the drive, which are changed.
        limit: greatest height above the lowest point of a structure [m].
    """
    editing = around.editing
    plants = [
        plant
        for plant in around.of_classes({"vegetation"})
        if plant.top - plant.bottom > limit
    ]
    for plant in plants:
        editing.shrink(plant, limit / (plant.top - plant.bottom), _CAUSE)
    num_lowered = num_uncut = 0
    for building in around.of_classes({"building"}):
        if building.top - building.bottom < limit + STOREY:
            continue
        model, X_WS = _as_model(building)
        rng = change_rng(around.seed, _CAUSE, building.name)
        low = lowered(model, limit, building.name, int(rng.integers(2**31)))
        if low is not model:
            editing.rebuild(building, model, low, X_WS, _CAUSE)
            num_lowered += 1
        elif top_of(model) >= limit + STOREY:
            num_uncut += 1
    if num_uncut:
        editing.note(
            "height_limit: higher buildings that stay, because their walls"
            f" enclose no area at {limit:g} m: {num_uncut}"
        )
    elif not plants and not num_lowered:
        editing.note(
            f"height_limit: no building and no plant is higher than {limit:g} m"
        )


EFFECT = Effect("height_limit", Phase.SHAPES, limit_heights)


def _as_model(building: SceneStructure) -> tuple[Model, RigidTransform]:
    """Returns a model with the parts of a building, and the pose X_WS.

    The frame S is parallel to W, with its origin at the height of the
    building's lowest point. The parts have the same order; their names are
    their numbers.
    """
    x, y = np.round(building.p_WPs[:, :2].mean(axis=0))
    p_WS = np.array([x, y, building.bottom])
    parts = []
    meshes = {}
    for number, part in enumerate(building.parts):
        mesh = f"{_object_mesh(part)}/{number}"
        meshes[mesh] = _mesh_in_S(part, p_WS)
        parts.append(
            Part(
                str(number),
                MeshShape(mesh),
                rgb=part.rgb,
                material=part.material.name,
            )
        )
    ground = hull_of((building.p_WPs - p_WS)[:, :2])
    return Model(tuple(parts), meshes, ground), RigidTransform(p_WS)


def _object_mesh(part: ScenePart) -> str:
    """Returns the name of a part's mesh, such as `roof_vents`.

    The result is "" if the mesh is none of the generator's meshes of objects.
    """
    name = getattr(part.shape, "mesh", "")
    return name if (OBJECT_MESHES / f"{name}.obj").is_file() else ""


def _mesh_in_S(part: ScenePart, p_WS: np.ndarray) -> Mesh:
    """Returns the triangles of a part, in S [m]; round shapes become prisms."""
    surface = tessellate(part.geometry.surface)
    R, p = part.X_WG[:3, :3], part.X_WG[:3, 3]
    vertices = surface.p_GVset @ R.T + p - p_WS
    return Mesh(vertices, tuple(map(tuple, surface.triangles.tolist())))
