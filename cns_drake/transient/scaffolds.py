"""Scaffolds before the fronts of buildings along a drive."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.city.geometry.structures import (
    Model,
    Part,
    assemble,
    bar,
    block,
    post,
)
from cns_drake.transient.draws import draws
from cns_drake.transient.ground_surface import GroundSurface
from cns_drake.transient.scene_editing import SceneEditing
from cns_drake.transient.standing import Obstacles, Standing

CAUSE = "scaffolds"
# Greatest distance of fronts from the drive [m].
_FARTHEST = 30.0
# A scaffold's inner and outer row of standards, from the front [m].
_INNER, _OUTER = 0.25, 1.15
# Height of lifts, length of bays, and greatest size of a scaffold [m].
_LIFT, _BAY = 2.0, 2.5
_LONGEST, _HIGHEST = 25.0, 16.0
_LEAST_LENGTH, _LEAST_HEIGHT = 4.0, 3.5
# Part of the scaffolds with a net.
_NETTED = 0.4
_STEEL = (0.6, 0.61, 0.62)
_WOOD = (0.62, 0.5, 0.35)
_NET = (0.35, 0.52, 0.42)
_NOT_THROUGH = frozenset({"building", "car", "truck", "bus", "other-structure"})


def put_up_scaffolds(
    editing: SceneEditing,
    things: Mapping[str, Standing],
    drive: BaseGeometry,
    kept_free: BaseGeometry,
    ground: GroundSurface,
    part: float,
    seed: int,
) -> None:
    """Puts scaffolds before a part of the fronts along a drive.

    A front without room before it gets none.

    Args:
        editing: of the world.
        things: all structures.
        drive: the way of the vehicle, seen from above [m].
        kept_free: area that stays free [m].
        ground: near the drive.
        part: share of the fronts, from 0 to 1.
        seed: of the draws.
    """
    fronts = [
        thing
        for thing in things.values()
        if thing.semantic_class == "building"
        and thing.footprint.area > 0.0
        and thing.footprint.distance(drive) < _FARTHEST
    ]
    if not fronts:
        editing.note(
            f"scaffolds: no building within {_FARTHEST:g} m of the drive"
        )
    obstacles = Obstacles.of_things(
        kept_free,
        (t for t in things.values() if t.semantic_class in _NOT_THROUGH),
    )
    for building in fronts:
        rng = draws(seed, CAUSE, building.name)
        if rng.uniform() >= part:
            continue
        X_WF, length = _front(building, drive)
        xy = X_WF.translation()[None, :2]
        foot = float(ground.heights(xy, of_road=False)[0])
        if not np.isfinite(foot):
            foot = building.bottom
        height = min(float(building.p_WPs[:, 2].max()) - foot, _HIGHEST)
        length = min(length, _LONGEST)
        corners = [
            X_WF @ [x, y, 0.0]
            for x, y in (
                (-length / 2, _INNER), (length / 2, _INNER),
                (length / 2, _OUTER + 0.1), (-length / 2, _OUTER + 0.1),
            )
        ]  # fmt: skip
        area = shapely.Polygon([corner[:2] for corner in corners])
        if (
            length >= _LEAST_LENGTH
            and height >= _LEAST_HEIGHT
            and obstacles.is_free(area, (building.name,))
        ):
            editing.add(
                f"scaffold_{building.name}",
                "other-structure",
                _scaffold(length, height, rng),
                RigidTransform([0.0, 0.0, foot]) @ X_WF,
                CAUSE,
            )


def _front(
    building: Standing, drive: BaseGeometry
) -> tuple[RigidTransform, float]:
    """Returns the pose of the front that faces a drive, and its length.

    The pose is that of the front's middle at z = 0, x along it and y away
    from the building.
    """
    rectangle = shapely.MultiPoint(
        shapely.get_coordinates(building.footprint)
    ).minimum_rotated_rectangle
    corners = shapely.get_coordinates(rectangle)
    middles = (corners[:-1] + corners[1:]) / 2
    k = int(np.argmin(shapely.distance(shapely.points(middles), drive)))
    along = corners[k + 1] - corners[k]
    length = float(np.linalg.norm(along))
    away = middles[k] - corners[:-1].mean(axis=0)
    yaw = float(np.arctan2(away[1], away[0])) - np.pi / 2
    return RigidTransform(RollPitchYaw(0, 0, yaw), [*middles[k], 0.0]), length


def _scaffold(length: float, height: float, rng: np.random.Generator) -> Model:
    """Returns a scaffold along x: standards, ledgers, decks, perhaps a net."""
    lifts = max(int(height / _LIFT), 1)
    bays = max(round(length / _BAY), 1)
    xs = np.linspace(-length / 2, length / 2, bays + 1)
    top = lifts * _LIFT + 1.0
    parts: list[Part] = [
        post(f"standard_{row}_{k:02d}", 0.03, top, (float(x), y), _STEEL)
        for row, y in enumerate((_INNER, _OUTER))
        for k, x in enumerate(xs)
    ]
    for k in range(1, lifts + 1):
        z = k * _LIFT
        parts.append(
            block(
                f"deck_{k}",
                (length, _OUTER - _INNER - 0.1, 0.05),
                (0.0, (_INNER + _OUTER) / 2, z),
                rgb=_WOOD,
            )
        )
        parts += [
            bar(
                f"rail_{k}_{j}",
                (-length / 2, _OUTER, z + up),
                (length / 2, _OUTER, z + up),
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
                (0.0, _OUTER + 0.05, (top + _LIFT) / 2),
                rgb=_NET,
            )
        )
    return assemble(*parts)
