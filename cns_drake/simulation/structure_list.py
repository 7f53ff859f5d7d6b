"""The list of structures that a recording carries."""

from __future__ import annotations

from cns_drake.scene.world import World


def structure_list(world: World) -> list[dict]:
    """Returns an entry for each structure of a world, ready for JSON."""
    return [
        {
            "instance": entry.instance,
            "name": entry.name,
            "class": entry.semantic_class,
            "label": entry.label,
            **({"causes": list(entry.causes)} if entry.causes else {}),
        }
        for entry in world.structures
    ]
