"""Renders the stages, meshes and table of structures of a city as texts."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from evaluation.base import MAX_INSTANCE, InputError, csv_text, doing
from worlds.city.generation.city_structures import City
from worlds.city.growth.stage_structures import GrowingCity
from worlds.city.stages import Stages, load_stages
from worlds.maps import MESH_FOLDER, STAGES_NAME, stage_name
from worlds.shapes import (
    CLASS_RGB,
    STRUCTURES_NAME,
    BoxShape,
    Mesh,
    MeshShape,
    Part,
    Shape,
    Structure,
)


def structures_csv(
    structures: Iterable[Structure], versions: Iterable[Structure] = ()
) -> str:
    """Returns the text of `structures.csv`, with a row for each structure.

    The columns are instance id (from 1), name, class, label (number of the
    class), position in W [m], yaw [rad], tags, and the materials of the parts
    (see `worlds.shapes.structure_table`). If the name of a structure does not
    state its kind, the table has a last column `kind`.

    Args:
        structures: the structures.
        versions: the structures as they are in all stages. A structure can have
            parts in one stage that it lacks in another.
    """
    materials: defaultdict[str, dict[str, str]] = defaultdict(dict)
    for one in versions:
        materials[one.name] |= one.materials
    rows = [
        one.row(instance, materials[one.name])
        for instance, one in enumerate(structures, start=1)
    ]
    columns = [
        "instance", "name", "class", "label", "x", "y", "z", "yaw", "tags",
        "material",
    ]  # fmt: skip
    if any(row["kind"] for row in rows):
        columns.append("kind")
    return csv_text(columns, ([row[name] for name in columns] for row in rows))


def meshes_of(structures: Iterable[Structure]) -> dict[str, Mesh]:
    """Returns all meshes of structures, as a mapping from name to mesh.

    Raises:
        ValueError: if two different meshes have the same name, or a mesh has no
            faces.
    """
    meshes: dict[str, Mesh] = {}
    for structure in structures:
        for name, mesh in structure.model.meshes.items():
            if not mesh.faces:
                raise ValueError(f"mesh {name} has no faces")
            known = meshes.setdefault(name, mesh)
            if known is not mesh and known.to_obj() != mesh.to_obj():
                raise ValueError(f"two different meshes are called {name}")
    return meshes


def render_city(
    world: Path,
    city: City,
    progress: Callable[[str], None] = lambda line: None,
    stages_text: str | None = None,
) -> dict[str, str]:
    """Returns the text of every generated file of a city, by relative path.

    Args:
        world: folder of the map, at which relative paths start.
        city: the city.
        progress: is called with a line of text after each step.
        stages_text: new content of `stages.yaml`; by default the file is read.

    Raises:
        InputError: if the stages cannot be used or the city has too many
            structures.
    """
    doing(f"drawing {len(city.structures)} structures")
    names = [structure.name for structure in city.structures]
    source = world / STAGES_NAME
    stages = load_stages(source, names, stages_text)
    files, _ = render_stages(
        world.resolve().name, city, stages, stages.stages, source, progress
    )
    progress(f"{sum(map(len, files.values())) / 1e6:.1f} MB")
    return files


def render_stages(
    world: str,
    city: City,
    stages: Stages,
    wanted: Iterable[str],
    source: Path,
    progress: Callable[[str], None] = lambda line: None,
    origin: str | None = None,
) -> tuple[dict[str, str], dict[str, tuple[int, int]]]:
    """Returns the files of some stages, and the sizes of these stages.

    Args:
        world: name of the map.
        city: the whole city.
        stages: the content of `stages.yaml`.
        wanted: names of the stages to write.
        source: file of the stages, named in error messages.
        progress: called with a message of one line after each file.
        origin: comment for readers of the files about the origin of the city.

    Returns:
        Relative path -> text of the file; and name of a stage -> numbers of
        structures and of triangles in the stage.

    Raises:
        InputError: the stages demand that a structure is lower or under
            construction, but the structure cannot be; or the city has too many
            structures.
    """
    growing = GrowingCity(city.structures, stages, city.cars)
    if len(growing.structures) > MAX_INSTANCE:
        raise InputError(
            f"{source.parent / 'city.yaml'}: {len(growing.structures)} "
            "structures are more than instance ids can count "
            f"({MAX_INSTANCE})"
        )
    comment = origin or (
        f"Generated by cns-drake city {world}; change roads.yaml, city.yaml "
        "and stages.yaml instead."
    )
    files: dict[str, str] = {}
    used: list[Structure] = []
    stood = {}
    for stage in wanted:
        try:
            standing = growing.at(stage)
        except ValueError as error:
            raise InputError(f"{source}: stages.{stage}.{error}") from error
        used += standing
        stood[stage] = standing
        files[stage_name(stage)] = world_sdf(
            f"{world}_{stage}", standing, comment=comment
        )
        progress(
            f"stage {stage} lacks {len(stages.absent(stage))} structures, "
            f"{len(stages.heights(stage))} are lower"
        )
    files[STRUCTURES_NAME] = structures_csv(growing.structures, used)
    texts = _mesh_texts(used)
    files |= {f"{MESH_FOLDER}/{name}.obj": text for name, text in texts.items()}
    triangles = {name: triangles_in(text) for name, text in texts.items()}
    sizes = {name: stage_size(one, triangles) for name, one in stood.items()}
    return files, sizes


def _mesh_texts(structures: Sequence[Structure]) -> dict[str, str]:
    """Returns the OBJ text of each mesh of all parts, by mesh name, sorted."""
    meshes = meshes_of(structures)
    shapes = [part.shape for one in structures for part in one.model.parts]
    names = {shape.mesh for shape in shapes if isinstance(shape, MeshShape)}
    return {name: meshes[name].to_obj() for name in sorted(names)}


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
