"""Puts up scaffolds in front of buildings along a drive."""

from pydrake.math import RigidTransform, RollPitchYaw

from cns_drake.transient.effect import Effect, Phase
from cns_drake.transient.surroundings import FARTHEST, Surroundings
from worlds.shapes import (
    HIGHEST_SCAFFOLD,
    LONGEST_SCAFFOLD,
    SCAFFOLD_ROWS,
    facing_side,
    scaffold,
)

# Least length of a scaffold [m].
_SHORTEST_SCAFFOLD = 4.0
# Least height of a scaffold [m].
_LOWEST_SCAFFOLD = 3.5
# Free room beyond a scaffold's outer uprights [m].
_BEYOND = 0.1
_NOT_THROUGH = frozenset({"building", "car", "truck", "bus", "other-structure"})


def put_up_scaffolds(around: Surroundings, share: float) -> None:
    """Puts up scaffolds in front of a share of the buildings along a drive.

    A building without free space in front gets no scaffold.

    Args:
        around: surroundings of the drive, which are changed.
        share: share of the buildings, from 0 to 1.
    """
    fronts = [
        building
        for building in around.of_classes({"building"})
        if building.footprint.area > 0.0
        and around.drive.distance(building.footprint) < FARTHEST
    ]
    if not fronts:
        around.editing.note(
            f"scaffolds: no building within {FARTHEST:g} m of the drive"
        )
    obstacles = around.obstacles_of(_NOT_THROUGH)
    for building, rng in around.chosen("scaffolds", fronts, share):
        front, length = facing_side(building.footprint, around.drive)
        length = min(length, LONGEST_SCAFFOLD)
        inner, outer = SCAFFOLD_ROWS
        area = front.rectangle(0.0, length, inner, outer + _BEYOND)
        # A quay beside the front does not count as the foot of the building.
        foot = max(around.ground.lowest(area, building.bottom), building.bottom)
        height = min(float(building.p_WPs[:, 2].max()) - foot, HIGHEST_SCAFFOLD)
        if (
            length >= _SHORTEST_SCAFFOLD
            and height >= _LOWEST_SCAFFOLD
            and obstacles.is_free(area, (building.name,))
        ):
            around.editing.add(
                f"scaffold_{building.name}",
                "other-structure",
                scaffold(length, height, rng),
                RigidTransform(
                    RollPitchYaw(0, 0, front.yaw), [*front.middle, foot]
                ),
                "scaffolds",
            )


EFFECT = Effect("scaffolds", Phase.OBJECTS, put_up_scaffolds, order=4)
