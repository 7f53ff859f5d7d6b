"""Applies all passing changes to a world."""

from __future__ import annotations

from shapely.geometry.base import BaseGeometry

from cns_drake.scenarios.scenario import TransientConfig
from cns_drake.scene.world import World
from cns_drake.transient.bays_refilled import change_parked_cars, make_bays
from cns_drake.transient.furniture import move_furniture
from cns_drake.transient.ground_surface import GroundSurface
from cns_drake.transient.leaves import thin_leaves
from cns_drake.transient.roadworks import put_up_works
from cns_drake.transient.scaffolds import put_up_scaffolds
from cns_drake.transient.scene_editing import SceneEditing
from cns_drake.transient.snow_cover import lay_snow
from cns_drake.transient.standing import read_standing

# Snow farther from the drive would be hardly visible to a LiDAR [m].
_NEAR = 120.0


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
        drive: the way of the vehicle, seen from above [m].
        kept_free: area where vehicles drive, seen from above [m]; it stays free
            of new things.

    Raises:
        InputError: a mesh cannot be read, or there are more structures than
            instance ids.
    """
    if config.is_off:
        return world
    editing = SceneEditing(world)
    things = read_standing(world)
    seed = config.seed
    if config.parked_cars > 0.0:
        bays = make_bays(things, kept_free)
        change_parked_cars(editing, things, bays, config.parked_cars, seed)
    if config.leaves < 1.0:
        thin_leaves(editing, things, config.leaves, seed)
    if config.furniture > 0.0:
        move_furniture(editing, things, kept_free, config.furniture, seed)
    if not (config.scaffolds or config.works or config.snow):
        return editing.finish()
    ground = GroundSurface(things, drive.buffer(_NEAR))
    for put_up, part in (
        (put_up_scaffolds, config.scaffolds),
        (put_up_works, config.works),
    ):
        if part > 0.0:
            put_up(editing, things, drive, kept_free, ground, part, seed)
    if config.snow > 0.0:
        # Snow comes last, so that it covers new things as well.
        world = editing.finish()
        editing = SceneEditing(world)
        lay_snow(
            editing, read_standing(world), drive, ground, config.snow, seed
        )
    return editing.finish()
