"""Makes all changes between drives in a loaded world, in a fixed order."""

import functools
import itertools

from cns_drake.scenarios import TransientConfig
from cns_drake.scene import World, geometry_by_structure
from cns_drake.transient.effect import Effect, Phase
from cns_drake.transient.scene_editing import SceneEditing
from cns_drake.transient.surroundings import Surroundings
from evaluation.base import import_modules
from worlds.shapes import Area, Way


def change_world(
    world: World,
    config: TransientConfig,
    drive: Way,
    kept_free: Area,
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

    bare: Surroundings | None = None
    wanted = [
        effect
        for effect in effects()
        if getattr(config, effect.field)
        != TransientConfig.model_fields[effect.field].default
    ]
    for phase, some in itertools.groupby(wanted, key=lambda one: one.phase):
        around = Surroundings(
            SceneEditing(world),
            geometry_by_structure(world),
            drive,
            kept_free,
            config.seed,
            bare,
        )
        if phase == Phase.OBJECTS:
            bare = around
        for effect in some:
            effect.apply(around, getattr(config, effect.field))
        world = around.editing.finish()
    return world


@functools.cache
def effects() -> tuple[Effect, ...]:
    """Returns all effects, in the order in which they are applied."""
    modules = import_modules(str(__package__)).values()
    found = (one.EFFECT for one in modules if hasattr(one, "EFFECT"))
    return tuple(sorted(found, key=lambda one: (one.phase, one.order)))
