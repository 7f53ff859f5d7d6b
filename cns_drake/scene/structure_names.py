"""What the name of a geometry says: its structure, its part and its kind."""


def structure_name(geometry_name: str, *, is_scoped: bool = False) -> str:
    """Returns the name of the structure to which a geometry belongs.

    A visual named `tower_017/storey_03` belongs to `tower_017`; a visual
    without a slash belongs to its model.

    Args:
        geometry_name: scoped name of the geometry, such as
            `left::gripper::finger`.
        is_scoped: whether to return the whole name of a model, such as
            `left::gripper`. By default, only `gripper` is returned, as in
            structure tables.
    """
    model, _, visual = geometry_name.rpartition("::")
    structure, slash, _ = visual.partition("/")
    if slash:
        return structure
    return (model if is_scoped else model.rpartition("::")[2]) or visual


def part_name(geometry_name: str) -> str:
    """Returns the name of a geometry as a part of its structure.

    A visual named `tower_017/storey_03` is the part `storey_03`; a visual
    without a slash is a part with the visual's name.
    """
    visual = geometry_name.rpartition("::")[2]
    _, slash, part = visual.partition("/")
    return part if slash else visual
