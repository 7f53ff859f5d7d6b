"""The city of a past year, from the years in which buildings were built."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cns_drake.ageing import kinds
from cns_drake.ageing.events import TAKEN_DOWN, Event
from cns_drake.ageing.old_world import OldWorld
from cns_drake.city.geometry import Structure
from cns_drake.city.growth.lot_uses import lot_objects, use_by_size
from cns_drake.city.plants.plant_sizes import younger_plant

# In each past year, a tree was lower by this height [m].
_GROWTH = 0.4
# Trees were never lower than this [m].
_LEAST_TREE = 2.0


def past_structures(
    world: OldWorld, year: int
) -> tuple[dict[str, Structure | None], list[Event]]:
    """Returns the structures of a past year, and the events since then.

    Buildings that were built after that year are missing, and their lots have
    another use. Trees are smaller. The city must have years of construction, so
    `world.today` is not None.

    Args:
        world: the city of today.
        year: the year relative to today, negative.

    Returns:
        Name of each structure -> the structure, or None if it is the same as
        today; and the events in order of time.
    """
    assert world.today is not None
    standing: dict[str, Structure | None] = dict.fromkeys(world.visuals)
    events = []
    for name, one in world.geometry.items():
        built = world.built.get(name)
        if built is not None and built - world.today > year:
            since = built - world.today
            events.append(Event(since, "built", name))
            del standing[name]
            for former in _objects_before(world, name, built):
                standing[former.name] = former
                events.append(
                    Event(since, TAKEN_DOWN, former.name, detail="empty plot")
                )
        elif one.semantic_class == "vegetation":
            height = one.top - one.bottom
            if height > _LEAST_TREE and one.kind == kinds.TREE:
                young = max(height + _GROWTH * year, _LEAST_TREE)
                whole = world.structure(name)
                model = younger_plant(whole.model, young)
                standing[name] = replace(whole, model=model)
    events.sort(key=lambda event: event.year)
    return standing, events


def _objects_before(
    world: OldWorld, name: str, built: int
) -> Iterator[Structure]:
    """Returns the objects on a lot before its building was built.

    Args:
        world: the city of today.
        name: name of the building.
        built: calendar year in which it was built.
    """
    lot = world.structure(name)
    rng = np.random.default_rng(built)
    return lot_objects(lot, use_by_size(lot), {"hatchback": 1}, rng)
