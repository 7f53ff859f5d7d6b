"""The SDF of a world: its structures as visuals."""

from collections.abc import Iterable
from xml.sax.saxutils import quoteattr

import numpy as np

from cns_drake.city.geometry.models import MeshShape, Part, Shape
from cns_drake.city.geometry.structures import Structure
from cns_drake.scene import CLASS_RGB, MESH_FOLDER


# Paths of meshes are relative to the SDF file. A stage therefore needs no
# package map, wherever the world's folder is.
def world_sdf(
    world: str,
    structures: Iterable[Structure],
    *,
    comment: str,
    before: Iterable[str] = (),
) -> str:
    """Returns the SDF of a world: all structures as visuals of one static link.

    Drake parses a static scene fastest in this form. A visual is named
    `<structure>/<part>`. There is no collision geometry.

    Args:
        world: name of the world.
        structures: the structures.
        comment: a line about the world for readers of the file.
        before: SDF texts of further visuals, which come first.
    """
    lines = [
        '<?xml version="1.0"?>',
        f"<!-- {comment.replace('--', '-')} -->",
        '<sdf version="1.9">',
        f"<world name={quoteattr(world)}>",
        f"<model name={quoteattr(world)}>",
        "<static>true</static>",
        '<link name="city">',
        *before,
    ]
    for structure in structures:
        lines.extend(_visual(structure, part) for part in structure.model.parts)
    lines += ["</link>", "</model>", "</world>", "</sdf>", ""]
    return "\n".join(lines)


def _visual(structure: Structure, part: Part) -> str:
    rgb = part.rgb or CLASS_RGB[structure.semantic_class]
    diffuse = " ".join(_number_text(value, 3) for value in (*rgb, 1.0))
    return (
        f"<visual name={quoteattr(f'{structure.name}/{part.name}')}>"
        f"<pose>{_pose(structure, part)}</pose>"
        f"<geometry>{_geometry(part.shape)}</geometry>"
        f"<material><diffuse>{diffuse}</diffuse></material>"
        "</visual>"
    )


def _pose(structure: Structure, part: Part) -> str:
    """Returns the pose X_WP of a part as SDF text: `x y z roll pitch yaw`.

    SDF's roll-pitch-yaw is Rz(yaw) Ry(pitch) Rx(roll). A structure only turns
    about z, so R_WP = R_WS R_SP only adds the structure's yaw.
    """
    roll, pitch, yaw = part.rpy
    angles = (roll, pitch, yaw + structure.yaw)
    return " ".join(
        [_number_text(v, 3) for v in structure.p_WP(part.xyz)]
        + [_number_text(v, 5) for v in angles]
    )


def _geometry(shape: Shape) -> str:
    if isinstance(shape, MeshShape):
        uri = f"<uri>{MESH_FOLDER}/{shape.mesh}.obj</uri>"
        if shape.scale == (1.0, 1.0, 1.0):
            return f"<mesh>{uri}</mesh>"
        scale = " ".join(_number_text(value, 5) for value in shape.scale)
        return f"<mesh>{uri}<scale>{scale}</scale></mesh>"
    tag = type(shape).__name__.removesuffix("Shape").lower()
    sizes = [
        (name, " ".join(_number_text(v, 3) for v in np.atleast_1d(value)))
        for name, value in vars(shape).items()
    ]
    inner = "".join(f"<{name}>{size}</{name}>" for name, size in sizes)
    return f"<{tag}>{inner}</{tag}>"


def _number_text(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
