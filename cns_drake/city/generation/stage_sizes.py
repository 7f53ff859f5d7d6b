"""Sizes of stages: numbers of structures and triangles."""

from collections.abc import Iterable, Mapping

from cns_drake.city.geometry.models import BoxShape, MeshShape, Shape
from cns_drake.city.geometry.structures import Structure

# Triangles of a box.
_OF_BOX = 12


def triangles_in(obj: str) -> int:
    """Returns the number of triangles in the text of an OBJ file."""
    faces = obj[obj.find("\nf ") :]
    # A face with three corners has three spaces; each further corner adds one.
    return faces.count(" ") - 2 * faces.count("f")


def count_triangles(
    shapes: Iterable[Shape], triangles: Mapping[str, int]
) -> int:
    """Returns how many triangles LiDARs see in shapes.

    Cylinders and spheres have no triangles.

    Args:
        shapes: the shapes.
        triangles: name of a mesh -> number of triangles in its file.
    """
    return sum(
        triangles[shape.mesh]
        if isinstance(shape, MeshShape)
        else _OF_BOX * isinstance(shape, BoxShape)
        for shape in shapes
    )


def stage_size(
    structures: Iterable[Structure], triangles: Mapping[str, int]
) -> tuple[int, int]:
    """Returns the numbers of structures and of triangles in a stage.

    Only structures with a surface count. `triangles` is as for
    `count_triangles`.
    """
    parts = [one.model.parts for one in structures if one.model.parts]
    shapes = (part.shape for some in parts for part in some)
    return len(parts), count_triangles(shapes, triangles)
