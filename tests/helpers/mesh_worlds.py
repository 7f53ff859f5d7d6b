"""Worlds that show one mesh."""

from cns_drake.scene import load_world, read_perception_geometry
from helpers.small_map import world_text


def world_of(path):
    """A world in the mesh's folder, whose only visual `thing` is the mesh."""
    mesh = f"<geometry><mesh><uri>{path.name}</uri></mesh></geometry>"
    sdf = path.parent / "world.sdf"
    sdf.write_text(world_text([f'<visual name="thing">{mesh}</visual>']))
    return load_world(sdf)


def read_mesh(path):
    """The surface of a mesh in a world."""
    inspector = world_of(path).scene_graph.model_inspector()
    (thing,) = read_perception_geometry(inspector)
    return thing.surface


def notes_of(path):
    """What a world says of a mesh in it, without the mesh's file."""
    return tuple(
        note.removeprefix(f"{path}: ") for note in world_of(path).notes
    )
