"""Applies all passing changes to a world."""

from dataclasses import replace
import math

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.scenarios.scenario import TransientConfig
from cns_drake.scene.surfaces import TriangleSurface
from cns_drake.scene.world import World
from cns_drake.transient import putting_up
from cns_drake.transient.parked_cars import change_parked_cars
from cns_drake.transient.scene_editing import SceneEditing, Surroundings
from cns_drake.transient.snow_cover import lay_snow
from cns_drake.transient.world_structures import (
    GROUND_CLASSES,
    StructurePart,
    draws,
    read_structures,
)

_FURNITURE = frozenset({"pole", "traffic-sign"})
# Greatest move of furniture [m].
_NEAREST, _FARTHEST = 0.3, 2.0
_TURN = 0.15  # [rad]
# Ground that differs by more in height is beyond a kerb [m].
_KERB = 0.1
_TRIES = 24
_LEAVES = ("crown", "lea", "foliage", "canopy", "plants", "hedge")
# Share of the surface of a shrub without separate wood that stays, as twigs.
_TWIGS = 0.1


def change_world(
    world: World,
    config: TransientConfig,
    drive: BaseGeometry,
    kept_free: BaseGeometry,
) -> World:
    """Returns a world in which time has passed.

    Args:
        world: not yet a part of a diagram; its SceneGraph is changed.
        config: the changes.
        drive, kept_free: the way of the vehicle, and the area that stays free
            of new things, seen from above [m].

    Raises:
        InputError: a mesh cannot be read, or there are more structures than
            instance ids.
    """
    if config.is_off:
        return world
    around = Surroundings(
        SceneEditing(world),
        read_structures(world),
        drive,
        kept_free,
        config.seed,
    )
    if config.roadsides > 0.0:
        # What stands there changes as all else does.
        putting_up.fill_roadsides(around, config.roadsides)
        rest = config.replaced(roadsides=0.0)
        return change_world(around.editing.finish(), rest, drive, kept_free)
    if config.parked_cars > 0.0:
        change_parked_cars(around, config.parked_cars)
    if config.leaves < 1.0:
        _thin_leaves(around, config.leaves)
    if config.furniture > 0.0:
        _move_furniture(around, config.furniture)
    if config.scaffolds > 0.0:
        putting_up.put_up_scaffolds(around, config.scaffolds)
    if config.works > 0.0:
        putting_up.put_up_works(around, config.works)
    if config.snow > 0.0:
        # Snow comes last, so that it covers new things as well.
        ground, world = around.ground, around.editing.finish()
        around = replace(
            around, editing=SceneEditing(world), things=read_structures(world)
        )
        lay_snow(around, ground, config.snow)
    return around.editing.finish()


def _move_furniture(around: Surroundings, share: float) -> None:
    """Replaces a share of poles, lamps and signs within 2 m.

    An object without room around it stays, and none crosses a kerb.
    """
    wanted = around.of_classes(_FURNITURE)
    if not wanted:
        around.editing.note(
            "furniture: the world has no pole and no traffic sign"
        )
    obstacles = around.obstacles(ignored=GROUND_CLASSES)
    for thing, rng in around.chosen("furniture", wanted, share):
        foot = thing.footprint
        middle = np.array(foot.centroid.coords[0])
        for _ in range(_TRIES):
            angle, turn = rng.uniform(-1, 1, 2) * (np.pi, _TURN)
            by = rng.uniform(_NEAREST, _FARTHEST)
            offset = by * np.array([math.cos(angle), math.sin(angle)])
            rise = around.ground.rise(middle, middle + offset)
            if abs(rise) < _KERB and obstacles.is_free(
                shapely.affinity.translate(foot, *offset), (thing.name,)
            ):
                X_new = (
                    RigidTransform([*(middle + offset), rise])
                    @ RigidTransform(RollPitchYaw(0, 0, turn), np.zeros(3))
                    @ RigidTransform([*-middle, 0.0])
                )
                around.editing.move(
                    thing, X_new, f"new_{thing.name}", "furniture"
                )
                break


def _thin_leaves(around: Surroundings, share: float) -> None:
    """Takes leaves off all vegetation, but for a share of them.

    Plants of one mesh lose the same leaves of it; turned and stretched as
    they are, they differ.
    """
    changed = False
    for plant in around.of_classes({"vegetation"}):
        leafy = [part for part in plant.parts if _is_leafy(part)]
        left = share
        if len(leafy) == len(plant.parts):
            left = max(share, _TWIGS)
        for part in leafy:
            surface = part.geometry.surface
            assert isinstance(surface, TriangleSurface)
            count = len(surface.triangles)
            # The key is the mesh's size, not its file, whose place must not
            # matter.
            order = draws(around.seed, "leaves", str(count)).permutation(count)
            around.editing.keep_triangles(
                part, np.sort(order[: round(left * count)])
            )
        if leafy:
            changed = True
            around.editing.blame(plant.name, "leaves")
    if not changed:
        around.editing.note(
            "leaves: no structure of class vegetation has leaves that are "
            "triangles"
        )


def _is_leafy(part: StructurePart) -> bool:
    """Returns whether a part is leaves and not wood, by name or by colour."""
    if not isinstance(part.geometry.surface, TriangleSurface):
        return False
    name = part.name.lower()
    if any(word in name for word in _LEAVES):
        return True
    r, g, b = part.geometry.rgb or (0.0, 0.0, 0.0)
    return g > 1.1 * r and g > 1.1 * b
