"""SDF text of a city stage: one static model, one link, named visuals."""

from __future__ import annotations

from collections.abc import Iterable
from xml.sax.saxutils import quoteattr

from cns_drake.base.map_folder import MESH_FOLDER
from cns_drake.city.geometry.structures import (
    BoxShape,
    CylinderShape,
    MeshShape,
    Part,
    Shape,
    SphereShape,
    Structure,
)
from cns_drake.scene.semantics import CLASS_RGB

# Meshes are named relative to the SDF file, so that a stage needs no package
# map: it parses from wherever the world's folder lies.


def stage_sdf(
    world: str, structures: Iterable[Structure], *, comment: str
) -> str:
    """Returns a world with all structures as visuals of one static link.

    A static scene is parsed fastest as one link with many visuals, and it
    carries no collision geometry because nothing ever touches it. The
    visual's name is `<structure>/<part>`; Drake keeps it as the geometry
    name, which is how a LiDAR return finds its structure.

    Args:
        world: the name of the world and of its model.
        structures: what stands at this stage.
        comment: one line for the reader of the file.
    """
    lines = [
        '<?xml version="1.0"?>',
        f"<!-- {comment.replace('--', '-')} -->",
        '<sdf version="1.9">',
        f"<world name={quoteattr(world)}>",
        f"<model name={quoteattr(world)}>",
        "<static>true</static>",
        '<link name="city">',
    ]
    for structure in structures:
        lines.extend(_visual(structure, part) for part in structure.model.parts)
    lines += ["</link>", "</model>", "</world>", "</sdf>", ""]
    return "\n".join(lines)


def _visual(structure: Structure, part: Part) -> str:
    rgb = part.rgb or CLASS_RGB[structure.semantic_class]
    diffuse = " ".join(_number(value, 3) for value in (*rgb, 1.0))
    return (
        f"<visual name={quoteattr(f'{structure.name}/{part.name}')}>"
        f"<pose>{_pose(structure, part)}</pose>"
        f"<geometry>{_geometry(part.shape)}</geometry>"
        f"<material><diffuse>{diffuse}</diffuse></material>"
        "</visual>"
    )


def _pose(structure: Structure, part: Part) -> str:
    """Returns X_WP as `x y z roll pitch yaw`.

    SDF's roll-pitch-yaw is Rz(yaw) Ry(pitch) Rx(roll), and a structure only
    turns about z, so that R_WP = R_WS R_SP just adds its yaw.
    """
    roll, pitch, yaw = part.rpy
    angles = (roll, pitch, yaw + structure.yaw)
    return " ".join(
        [_number(v, 3) for v in structure.p_WP(part.xyz)]
        + [_number(v, 5) for v in angles]
    )


def _geometry(shape: Shape) -> str:
    if isinstance(shape, MeshShape):
        uri = f"<uri>{MESH_FOLDER}/{shape.mesh}.obj</uri>"
        if shape.scale == (1.0, 1.0, 1.0):
            return f"<mesh>{uri}</mesh>"
        scale = " ".join(_number(value, 5) for value in shape.scale)
        return f"<mesh>{uri}<scale>{scale}</scale></mesh>"
    if isinstance(shape, BoxShape):
        size = " ".join(_number(value, 3) for value in shape.size)
        return f"<box><size>{size}</size></box>"
    if isinstance(shape, CylinderShape):
        radius, length = _number(shape.radius, 3), _number(shape.length, 3)
        return (
            f"<cylinder><radius>{radius}</radius>"
            f"<length>{length}</length></cylinder>"
        )
    if isinstance(shape, SphereShape):
        radius = _number(shape.radius, 3)
        return f"<sphere><radius>{radius}</radius></sphere>"
    raise TypeError(f"no SDF geometry for {type(shape).__name__}")


def _number(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
