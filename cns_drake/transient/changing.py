"""Makes all changes between drives in a loaded world, in a fixed order."""

from shapely.geometry.base import BaseGeometry

from cns_drake.scenarios import TransientConfig
from cns_drake.scene import World
from cns_drake.transient.furniture import move_furniture
from cns_drake.transient.height_limit import limit_heights
from cns_drake.transient.leaves import thin_leaves
from cns_drake.transient.parked_cars import change_parked_cars
from cns_drake.transient.roadsides import fill_roadsides
from cns_drake.transient.roadworks import put_up_works
from cns_drake.transient.scaffolds import put_up_scaffolds
from cns_drake.transient.scene_editing import SceneEditing
from cns_drake.transient.snow import lay_snow
from cns_drake.transient.structure_geometry import geometry_by_structure
from cns_drake.transient.surroundings import Surroundings


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

    def surroundings(world: World) -> Surroundings:
        structures = geometry_by_structure(world)
        editing = SceneEditing(world)
        return Surroundings(editing, structures, drive, kept_free, config.seed)

    if config.roadsides > 0.0:
        # New objects along roadsides are changed like all others.
        around = surroundings(world)
        fill_roadsides(around, config.roadsides)
        world = around.editing.finish()
    if config.height_limit is not None:
        # Scaffolds and snow need the new roofs, and leaves the new plants.
        around = surroundings(world)
        limit_heights(around, config.height_limit)
        world = around.editing.finish()
    if config.replaced(roadsides=0.0, height_limit=None).is_off:
        return world
    around = surroundings(world)
    _change_objects(around, config)
    world = around.editing.finish()
    if config.snow > 0.0:
        # Snow comes last, so that it covers new objects as well.
        ground = around.ground
        around = surroundings(world)
        lay_snow(around, ground, config.snow)
        world = around.editing.finish()
    return world


def _change_objects(around: Surroundings, config: TransientConfig) -> None:
    """Makes the changes that do not depend on each other."""
    if config.parked_cars > 0.0:
        change_parked_cars(around, config.parked_cars)
    if config.leaves < 1.0:
        thin_leaves(around, config.leaves)
    if config.furniture > 0.0:
        move_furniture(around, config.furniture)
    if config.scaffolds > 0.0:
        put_up_scaffolds(around, config.scaffolds)
    if config.works > 0.0:
        put_up_works(around, config.works)
