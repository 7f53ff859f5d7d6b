"""Puts up scaffolds in front of buildings along a drive."""

import math

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.transient.effect import Effect, Phase
from cns_drake.transient.structure_geometry import StructureGeometry
from cns_drake.transient.surroundings import FARTHEST, Surroundings
from worlds.shapes import (
    Model,
    Part,
    assemble,
    bar,
    block,
    post,
)

# Distance of a scaffold's inner uprights from the front [m].
_ROW_INNER = 0.25
# Distance of a scaffold's outer uprights from the front [m].
_ROW_OUTER = 1.15
# Height of a lift of a scaffold [m].
_LIFT = 2.0
# Length of a bay of a scaffold, about [m].
_BAY = 2.5
# Greatest length of a scaffold [m].
_LONGEST_SCAFFOLD = 25.0
# Greatest height of a scaffold [m].
_HIGHEST_SCAFFOLD = 16.0
# Least length of a scaffold [m].
_SHORTEST_SCAFFOLD = 4.0
# Least height of a scaffold [m].
_LOWEST_SCAFFOLD = 3.5
# Share of the scaffolds that have a net.
_NETTED = 0.4
_STEEL = (0.6, 0.61, 0.62)
_WOOD = (0.62, 0.5, 0.35)
_NET = (0.35, 0.52, 0.42)
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
        and building.footprint.distance(around.drive) < FARTHEST
    ]
    if not fronts:
        around.editing.note(
            f"scaffolds: no building within {FARTHEST:g} m of the drive"
        )
    obstacles = around.obstacles_of(_NOT_THROUGH)
    for building, rng in around.chosen("scaffolds", fronts, share):
        X_WF, length = _front(building, around.drive)
        length = min(length, _LONGEST_SCAFFOLD)
        corners = [
            X_WF @ [x, y, 0.0]
            for x, y in (
                (-length / 2, _ROW_INNER), (length / 2, _ROW_INNER),
                (length / 2, _ROW_OUTER + 0.1), (-length / 2, _ROW_OUTER + 0.1),
            )
        ]  # fmt: skip
        area = shapely.Polygon([corner[:2] for corner in corners])
        # A quay beside the front does not count as the foot of the building.
        foot = max(around.ground.lowest(area, building.bottom), building.bottom)
        height = min(
            float(building.p_WPs[:, 2].max()) - foot, _HIGHEST_SCAFFOLD
        )
        if (
            length >= _SHORTEST_SCAFFOLD
            and height >= _LOWEST_SCAFFOLD
            and obstacles.is_free(area, (building.name,))
        ):
            around.editing.add(
                f"scaffold_{building.name}",
                "other-structure",
                scaffold(length, height, rng),
                RigidTransform([0.0, 0.0, foot]) @ X_WF,
                "scaffolds",
            )


EFFECT = Effect("scaffolds", Phase.OBJECTS, put_up_scaffolds, order=4)


def _front(
    building: StructureGeometry, drive: BaseGeometry
) -> tuple[RigidTransform, float]:
    """Returns the pose of the front that faces a drive, and its length [m].

    The pose is in W: in the middle of the front at z = 0, with x along the
    front and y away from the building.
    """
    rectangle = shapely.MultiPoint(
        shapely.get_coordinates(building.footprint)
    ).minimum_rotated_rectangle
    corners = shapely.get_coordinates(rectangle)
    middles = (corners[:-1] + corners[1:]) / 2
    k = int(np.argmin(shapely.distance(shapely.points(middles), drive)))
    along = corners[k + 1] - corners[k]
    length = math.hypot(*along)
    away = middles[k] - corners[:-1].mean(axis=0)
    yaw = math.atan2(away[1], away[0]) - np.pi / 2
    return RigidTransform(RollPitchYaw(0, 0, yaw), [*middles[k], 0.0]), length


def scaffold(length: float, height: float, rng: np.random.Generator) -> Model:
    """Returns a scaffold along x: uprights, ledgers, decks, sometimes a net.

    Args:
        length: length of the scaffold [m].
        height: height of the facade [m].
        rng: random generator for the variant of the scaffold.
    """
    lifts = max(int(height / _LIFT), 1)
    bays = max(round(length / _BAY), 1)
    xs = np.linspace(-length / 2, length / 2, bays + 1)
    top = lifts * _LIFT + 1.0
    parts: list[Part] = [
        post(f"standard_{row}_{k:02d}", 0.03, top, (float(x), y), _STEEL)
        for row, y in enumerate((_ROW_INNER, _ROW_OUTER))
        for k, x in enumerate(xs)
    ]
    for k in range(1, lifts + 1):
        z = k * _LIFT
        parts.append(
            block(
                f"deck_{k}",
                (length, _ROW_OUTER - _ROW_INNER - 0.1, 0.05),
                (0.0, (_ROW_INNER + _ROW_OUTER) / 2, z),
                rgb=_WOOD,
            )
        )
        parts += [
            bar(
                f"rail_{k}_{j}",
                (-length / 2, _ROW_OUTER, z + up),
                (length / 2, _ROW_OUTER, z + up),
                0.025,
                _STEEL,
            )
            for j, up in enumerate((0.5, 1.0))
        ]
    if rng.uniform() < _NETTED:
        parts.append(
            block(
                "net",
                (length, 0.01, top - _LIFT),
                (0.0, _ROW_OUTER + 0.05, (top + _LIFT) / 2),
                rgb=_NET,
            )
        )
    return assemble(*parts)
