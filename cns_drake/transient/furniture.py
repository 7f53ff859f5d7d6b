"""Moves poles, lamps and signs between drives."""

import math

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from cns_drake.transient.effect import Effect, Phase
from cns_drake.transient.surroundings import Surroundings
from worlds.shapes import GROUND_CLASSES, placed

# Cause of these changes in the structure table.
_CAUSE = "furniture"
_FURNITURE = frozenset({"pole", "traffic-sign"})
# Least distance by which furniture moves [m].
_LEAST_SHIFT = 0.3
# Greatest distance by which furniture moves [m].
_MOST_SHIFT = 2.0
# Greatest angle by which furniture turns [rad].
_TURN = 0.15
# If the height of the ground differs by more than this, there is a kerb in
# between [m].
_KERB = 0.1
_TRIES = 24


def move_furniture(around: Surroundings, share: float) -> None:
    """Moves a share of poles, lamps and signs by up to 2 m.

    An object without room around it stays. No object is moved across a kerb.
    """
    wanted = around.of_classes(_FURNITURE)
    if not wanted:
        around.editing.note(
            "furniture: the world has no pole and no traffic sign"
        )
    obstacles = around.obstacles_except(GROUND_CLASSES)
    for piece, rng in around.chosen(_CAUSE, wanted, share):
        foot = piece.footprint
        middle = np.array(foot.centroid.coords[0])
        for _ in range(_TRIES):
            angle, turn = rng.uniform(-1, 1, 2) * (np.pi, _TURN)
            by = rng.uniform(_LEAST_SHIFT, _MOST_SHIFT)
            offset = by * np.array([math.cos(angle), math.sin(angle)])
            rise = around.ground.rise(middle, middle + offset)
            if abs(rise) < _KERB and obstacles.is_free(
                placed(foot, offset.tolist(), 0.0), (piece.name,)
            ):
                X_new = (
                    RigidTransform([*(middle + offset), rise])
                    @ RigidTransform(RollPitchYaw(0, 0, turn), np.zeros(3))
                    @ RigidTransform([*-middle, 0.0])
                )
                around.editing.move(piece, X_new, f"new_{piece.name}", _CAUSE)
                break


EFFECT = Effect("furniture", Phase.OBJECTS, move_furniture, order=3)
