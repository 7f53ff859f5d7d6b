"""All temporary changes to a world, and those of furniture and leaves."""

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
from cns_drake.transient.ground_surface import GROUND_CLASSES
from cns_drake.transient.height_limit import limit_heights
from cns_drake.transient.parked_cars import change_parked_cars
from cns_drake.transient.scene_editing import (
    SceneEditing,
    Surroundings,
    change_rng,
)
from cns_drake.transient.snow import lay_snow
from cns_drake.transient.world_structures import read_structures

_FURNITURE = frozenset({"pole", "traffic-sign"})
# Least distance by which furniture moves [m].
_LEAST_SHIFT = 0.3
# Greatest distance by which furniture moves [m].
_MOST_SHIFT = 2.0
_TURN = 0.15  # [rad]
# If the height of the ground differs by more than this, there is a kerb in
# between [m].
_KERB = 0.1
_TRIES = 24
# Of a shrub without wood of its own, this share of the surface stays as twigs.
_TWIGS = 0.1


def change_world(
    world: World,
    config: TransientConfig,
    drive: BaseGeometry,
    kept_free: BaseGeometry,
) -> World:
    """Applies the temporary changes of a scenario to a world.

    Args:
        world: the world, not yet part of a diagram; its SceneGraph is changed.
        config: the section `transient` of the scenario.
        drive: the path of the vehicle, seen from above [m].
        kept_free: the area that must stay free of new objects, seen from above
            [m].

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
        # New objects along roadsides are changed like all others.
        putting_up.fill_roadsides(around, config.roadsides)
        rest = config.replaced(roadsides=0.0)
        return change_world(around.editing.finish(), rest, drive, kept_free)
    if config.height_limit is not None:
        # Scaffolds and snow need the new roofs, and leaves the new plants.
        limit_heights(around, config.height_limit)
        rest = config.replaced(height_limit=None)
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
        # Snow comes last, so that it covers new objects as well.
        ground = around.ground
        world = around.editing.finish()
        around = replace(
            around, editing=SceneEditing(world), things=read_structures(world)
        )
        lay_snow(around, ground, config.snow)
    return around.editing.finish()


def _move_furniture(around: Surroundings, share: float) -> None:
    """Moves a share of poles, lamps and signs by up to 2 m.

    An object without room around it stays, and none crosses a kerb.
    """
    wanted = around.of_classes(_FURNITURE)
    if not wanted:
        around.editing.note(
            "furniture: the world has no pole and no traffic sign"
        )
    obstacles = around.obstacles_except(GROUND_CLASSES)
    for thing, rng in around.chosen("furniture", wanted, share):
        foot = thing.footprint
        middle = np.array(foot.centroid.coords[0])
        for _ in range(_TRIES):
            angle, turn = rng.uniform(-1, 1, 2) * (np.pi, _TURN)
            by = rng.uniform(_LEAST_SHIFT, _MOST_SHIFT)
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
    """Removes the leaves of all vegetation except for a share of them.

    Plants with the same mesh lose the same leaves of it, but look different
    because they are turned and scaled.
    """
    changed = False
    for plant in around.of_classes({"vegetation"}):
        leafy = [
            part
            for part in plant.parts
            if part.material.kind == "leaves"
            and isinstance(part.geometry.surface, TriangleSurface)
        ]
        left = share
        if len(leafy) == len(plant.parts):
            left = max(share, _TWIGS)
        for part in leafy:
            surface = part.geometry.surface
            assert isinstance(surface, TriangleSurface)
            count = len(surface.triangles)
            # The key is the size of the mesh, not its path, so that the result
            # does not depend on where the file is.
            order = change_rng(around.seed, "leaves", str(count)).permutation(
                count
            )
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
