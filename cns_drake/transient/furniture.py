"""Poles, lamps and signs that were replaced close by."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.transient.draws import draws
from cns_drake.transient.scene_editing import SceneEditing
from cns_drake.transient.standing import GROUND_CLASSES, Obstacles, Standing

CAUSE = "furniture"
CLASSES = frozenset({"pole", "traffic-sign"})
# Greatest move [m].
_NEAREST, _FARTHEST = 0.3, 2.0
_TURN = 0.15  # [rad]
_TRIES = 24


def move_furniture(
    editing: SceneEditing,
    things: Mapping[str, Standing],
    kept_free: BaseGeometry,
    part: float,
    seed: int,
) -> None:
    """Replaces a part of poles, lamps and signs within 2 m.

    An object without room around it stays.

    Args:
        editing: of the world.
        things: all structures.
        kept_free: area that stays free, seen from above [m].
        part: share of them, from 0 to 1.
        seed: of the draws.
    """
    wanted = [t for t in things.values() if t.semantic_class in CLASSES]
    if not wanted:
        editing.note("furniture: the world has no pole and no traffic sign")
    obstacles = Obstacles.of_things(
        kept_free,
        (t for t in things.values() if t.semantic_class not in GROUND_CLASSES),
    )
    for thing in wanted:
        rng = draws(seed, CAUSE, thing.name)
        if rng.uniform() >= part:
            continue
        foot = thing.footprint
        middle = np.array(foot.centroid.coords[0])
        for _ in range(_TRIES):
            angle, turn = rng.uniform(-1, 1, 2) * (np.pi, _TURN)
            by = rng.uniform(_NEAREST, _FARTHEST)
            offset = by * np.array([np.cos(angle), np.sin(angle)])
            if obstacles.is_free(
                shapely.affinity.translate(foot, *offset), (thing.name,)
            ):
                X_new = (
                    RigidTransform([*(middle + offset), 0.0])
                    @ RigidTransform(RollPitchYaw(0, 0, turn), np.zeros(3))
                    @ RigidTransform([*-middle, 0.0])
                )
                editing.move(thing, X_new, f"new_{thing.name}", CAUSE)
                break
