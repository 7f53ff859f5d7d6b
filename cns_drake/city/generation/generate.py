"""Writes a city's stages, meshes and table of structures."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
import re
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np
from scipy.spatial import cKDTree
import yaml

from cns_drake.base.csv_files import csv_text, read_records
from cns_drake.base.errors import InputError
from cns_drake.base.files import read_bytes, user_errors, write_text
from cns_drake.base.number_text import to_number
from cns_drake.base.progress import doing
from cns_drake.base.yaml_files import MarkedYamlLoader, read_yaml
from cns_drake.city.generation.city_structures import City, make_city, meshes_of
from cns_drake.city.geometry.structures import (
    BoxShape,
    MeshShape,
    Part,
    Shape,
    Structure,
)
from cns_drake.city.growth.stage_structures import GrowingCity
from cns_drake.city.plan.stages import Stages, load_stages
from cns_drake.scene.labels import MAX_INSTANCE
from cns_drake.scene.map_folder import (
    MESH_FOLDER,
    STAGES_NAME,
    STRUCTURES_NAME,
    stage_name,
)
from cns_drake.scene.material_cells import write_materials
from cns_drake.scene.semantics import CLASS_IDS, CLASS_RGB

# A structure that has moved farther than this counts as a new one [m].
_SAME_PLACE = 0.3
_COLUMNS = ("name", "class", "x", "y", "tags")
# Triangles of a box.
_OF_BOX = 12


class Renaming(NamedTuple):
    """How the names in `stages.yaml` must change after a change of the city.

    Attributes:
        renamed: old name -> new name, for each structure that is still at the
            same place but has another name now.
        lost: names of structures that no longer exist at their place, even if
            another structure now has this name.
        unclear: patterns that match different structures than before.
    """

    renamed: dict[str, str]
    lost: list[str]
    unclear: list[str]


class _Row(NamedTuple):
    name: str
    semantic_class: str
    xy: tuple[float, float]
    tags: str

    @property
    def stem(self) -> str:
        return re.sub(r"_\d+$", "", self.name)


def find_renaming(
    stages: Path, table: Path, structures: Sequence[Structure]
) -> Renaming:
    """Returns how names in `stages.yaml` must change for the current city.

    A structure of the earlier city and a structure of the current city count as
    the same structure if both are of the same kind and at the same place.

    Args:
        stages: the file `stages.yaml`.
        table: the file `structures.csv` of the earlier city, for which `stages`
            was written.
        structures: the structures of the current city.

    Raises:
        InputError: a file cannot be read.
    """
    before = {row.name: row for row in _read(table)}
    today = [
        _Row(one.name, one.semantic_class, one.xyz[:2], " ".join(one.tags))
        for one in structures
    ]
    successor = _successors(list(before.values()), today)
    names = {row.name for row in today}
    renamed: dict[str, str] = {}
    lost: list[str] = []
    unclear: list[str] = []
    for name in dict.fromkeys(node.value for node in _name_nodes(stages)):
        if "*" in name or "?" in name:
            if _has_changed(name, before, names, successor):
                unclear.append(name)
        elif name not in before:
            # The name is new or misspelt. Generating the stages reports
            # misspelt names.
            continue
        elif name not in successor:
            lost.append(name)
        elif successor[name] != name:
            renamed[name] = successor[name]
    return Renaming(renamed, lost, unclear)


def renamed_text(stages: Path, renamed: Mapping[str, str]) -> str:
    """Returns the text of `stages.yaml` with structures renamed.

    Comments and order stay unchanged. `renamed` maps old names to new names.

    Raises:
        InputError: the file cannot be read.
    """
    text = _text(stages)
    nodes = _name_nodes(stages)
    for node in sorted(nodes, key=lambda node: -node.start_mark.index):
        if node.value in renamed:
            start, end = node.start_mark.index, node.end_mark.index
            # The scalar may have an anchor in front of it.
            head, _, tail = text[start:end].rpartition(node.value)
            new = head + renamed[node.value] + tail
            text = text[:start] + new + text[end:]
    return text


def _text(path: Path) -> str:
    try:
        return read_bytes(path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8") from error


def _name_nodes(path: Path) -> list[yaml.ScalarNode]:
    """Returns the YAML scalars in a file of stages that name structures."""
    read_yaml(path)  # Errors in one line.
    # Only this slower loader records where in the text a node is.
    root = yaml.compose(_text(path), MarkedYamlLoader)
    lists = [
        node
        for _, stage in _items(root, "stages")
        for node in (
            *(group for _, group in _items(stage, "absent")),
            *(
                part
                for kind in ("lower", "sites")
                for _, growth in _items(stage, kind)
                for key, part in _pairs(growth)
                if key in ("structures", "but")
            ),
        )
    ]
    lists += [node for _, node in _items(root, "lots")]
    # A node that aliases refer to several times is replaced only once.
    scalars = {
        id(node): node
        for group in lists
        if isinstance(group, yaml.SequenceNode)
        for node in group.value
        if isinstance(node, yaml.ScalarNode)
    }
    return list(scalars.values())


def _items(node: yaml.Node | None, key: str) -> list[tuple[str, yaml.Node]]:
    """Returns key and value of each pair in the mapping under a key."""
    return [
        pair
        for name, value in _pairs(node)
        if name == key
        for pair in _pairs(value)
    ]


def _pairs(node: yaml.Node | None) -> list[tuple[str, yaml.Node]]:
    """Returns the pairs of a mapping, with those merged into it (`<<`)."""
    if not isinstance(node, yaml.MappingNode):
        return []
    pairs = []
    for key, value in node.value:
        if key.value == "<<":
            merged = (
                value.value if isinstance(value, yaml.SequenceNode) else [value]
            )
            pairs += [pair for part in merged for pair in _pairs(part)]
        else:
            pairs.append((key.value, value))
    return pairs


def _has_changed(
    pattern: str,
    before: Iterable[str],
    today: Iterable[str],
    successor: Mapping[str, str],
) -> bool:
    """Returns whether a pattern now matches other structures than before.

    Structures that are new or lost do not count.
    """
    meant = {
        successor[name]
        for name in before
        if name in successor and fnmatchcase(name, pattern)
    }
    known = set(successor.values())
    return meant != {
        name for name in today if name in known and fnmatchcase(name, pattern)
    }


def _read(table: Path) -> list[_Row]:
    rows = []
    for line, row in read_records(table, _COLUMNS):
        xy = to_number(row["x"]), to_number(row["y"])
        if not np.isfinite(xy).all():
            raise InputError(f"{table}: line {line}: no finite x and y")
        rows.append(_Row(row["name"], row["class"], xy, row["tags"]))
    return rows


def _successors(
    before: Sequence[_Row], today: Sequence[_Row]
) -> dict[str, str]:
    """Returns old name -> new name of structures that have kept their place."""
    if not before or not today:
        return {}
    tree = cKDTree([row.xy for row in today])
    pairs = []
    for row in before:
        for k in tree.query_ball_point(row.xy, _SAME_PLACE):
            other = today[k]
            # Usually there is one structure of a kind at a place. If there are
            # two, such as the grounds of two districts, their names decide.
            if (
                row.stem == other.stem
                and row.semantic_class == other.semantic_class
            ):
                gap = float(np.hypot(*np.subtract(row.xy, other.xy)))
                unlike = (row.name != other.name, row.tags != other.tags)
                pairs.append((gap > 0.01, unlike, gap, row.name, other.name))
    found: dict[str, str] = {}
    taken: set[str] = set()
    for *_, old, new in sorted(pairs):
        if old not in found and new not in taken:
            found[old] = new
            taken.add(new)
    return found


# Paths of meshes are relative to the SDF file. A stage therefore needs no
# package map, wherever the world's folder is.
def stage_sdf(
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
    diffuse = " ".join(_number(value, 3) for value in (*rgb, 1.0))
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
    tag = type(shape).__name__.removesuffix("Shape").lower()
    sizes = [
        (name, " ".join(_number(v, 3) for v in np.atleast_1d(value)))
        for name, value in vars(shape).items()
    ]
    inner = "".join(f"<{name}>{size}</{name}>" for name, size in sizes)
    return f"<{tag}>{inner}</{tag}>"


def _number(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def triangles_in(obj: str) -> int:
    """Returns the number of triangles in the text of an OBJ file."""
    faces = obj[obj.find("\nf ") :]
    # A face with three corners has three spaces; each further corner adds one.
    return faces.count(" ") - 2 * faces.count("f")


def count_triangles(
    shapes: Iterable[Shape], triangles: Mapping[str, int]
) -> int:
    """Returns the number of triangles of shapes as LiDARs see them.

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


def structure_table(
    structures: Iterable[Structure], versions: Iterable[Structure] = ()
) -> str:
    """Returns the text of `structures.csv`, with a row for each structure.

    The columns are instance id (from 1), name, class, label (number of the
    class), position in W [m], yaw [rad], tags, and the materials of the parts
    (see `cns_drake.scene.material_cells`). If the name of a structure does not
    state its kind, the table has a last column `kind`.

    Args:
        structures: the structures.
        versions: the structures as they are in all stages. A structure can have
            parts in one stage that it lacks in another.
    """
    structures = list(structures)
    names = [
        "instance", "name", "class", "label", "x", "y", "z", "yaw", "tags",
        "material",
    ]  # fmt: skip
    with_kinds = any(one.kind_cell for one in structures)
    if with_kinds:
        names.append("kind")
    materials: defaultdict[str, dict[str, str]] = defaultdict(dict)
    for one in versions:
        materials[one.name] |= one.materials
    rows = (
        [
            instance,
            one.name,
            one.semantic_class,
            CLASS_IDS[one.semantic_class],
            *(f"{value:.3f}" for value in one.xyz),
            f"{one.yaw:.5f}",
            " ".join(one.tags),
            write_materials(
                one.semantic_class, materials[one.name] | one.materials
            ),
            *([one.kind_cell] if with_kinds else []),
        ]
        for instance, one in enumerate(structures, start=1)
    )
    return csv_text(names, rows)


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
        InputError: if a structure cannot be lower, or cannot be under
            construction, as the stages demand, or the city has too many
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
        files[stage_name(stage)] = stage_sdf(
            f"{world}_{stage}", standing, comment=comment
        )
        progress(
            f"stage {stage} lacks {len(stages.absent(stage))} structures, "
            f"{len(stages.heights(stage))} are lower"
        )
    files[STRUCTURES_NAME] = structure_table(growing.structures, used)
    meshes = meshes_of(used)
    shapes = [part.shape for one in used for part in one.model.parts]
    names = {shape.mesh for shape in shapes if isinstance(shape, MeshShape)}
    triangles = {}
    for name in sorted(names):
        text = meshes[name].to_obj()
        files[f"{MESH_FOLDER}/{name}.obj"] = text
        triangles[name] = triangles_in(text)
    sizes = {name: stage_size(one, triangles) for name, one in stood.items()}
    return files, sizes


def generate_city(
    world: Path,
    progress: Callable[[str], None] = lambda line: None,
    *,
    repair_stages: bool = False,
) -> list[Path]:
    """Writes all generated files of a map's folder, and returns their paths.

    The same inputs give the same bytes. Each file is replaced atomically.
    Stages and meshes that no longer belong to the city are removed.

    Args:
        world: the folder.
        progress: called with messages of one line on the progress.
        repair_stages: whether to update the names in `stages.yaml`, if
            structures at the same place have other names now than in
            `structures.csv`.

    Raises:
        InputError: if an input cannot be used or a file cannot be written; if a
            structure in `stages.yaml` has another name now and `repair_stages`
            is false; or if a structure in `stages.yaml` no longer exists.
    """
    world = Path(world)
    if (world / MESH_FOLDER).is_symlink():
        # The linked folder may belong to another map.
        raise InputError(f"{world / MESH_FOLDER}: a link instead of a folder")
    files = _rendered_files(world, progress, repair_stages)
    doing("writing the stages")
    with user_errors(world / MESH_FOLDER):
        (world / MESH_FOLDER).mkdir(exist_ok=True)
    for name, content in files.items():
        write_text(world / name, content)
    for path in _generated_files(world) - {world / name for name in files}:
        with user_errors(path):
            path.unlink()
    return [world / name for name in files if name != STAGES_NAME]


def _rendered_files(
    world: Path, progress: Callable[[str], None], repair_stages: bool
) -> dict[str, str]:
    """Returns the text of every file to write, by relative path."""
    doing("laying out the city")
    city = make_city(world)
    text = _stages_text(world, city, repair_stages, progress)
    files = render_city(world, city, progress, text)
    return files if text is None else {STAGES_NAME: text, **files}


def _stages_text(
    world: Path, city: City, repair: bool, progress: Callable[[str], None]
) -> str | None:
    """Returns the new text of `stages.yaml`, or None if it stays the same.

    Raises:
        InputError: see `generate_city`.
    """
    stages, table = world / STAGES_NAME, world / STRUCTURES_NAME
    if not table.exists() and not repair:
        return None
    try:
        found = find_renaming(stages, table, city.structures)
    except InputError:
        if repair:
            raise
        # A faulty table is written anew anyway, and faulty stages are reported
        # later.
        return None
    if not repair:
        for old, new in found.renamed.items():
            raise InputError(
                f"{stages}: {old} is {new} now, and {len(found.renamed) - 1} "
                "more have other names; --repair-stages writes the new names "
                f"(if they are there already, remove {STRUCTURES_NAME})"
            )
        return None
    for old, new in found.renamed.items():
        progress(f"{old} is {new} now")
    for name in found.lost:
        progress(f"{name} has no counterpart")
    for pattern in found.unclear:
        progress(f"{pattern} matches other structures than before")
    if found.lost:
        raise InputError(
            f"{stages}: {len(found.lost)} structure(s) have no counterpart, "
            f"such as {found.lost[0]}; take them out, then repair again"
        )
    return renamed_text(stages, found.renamed) if found.renamed else None


def differing_files(
    world: Path,
    progress: Callable[[str], None] = lambda line: None,
    *,
    repair_stages: bool = False,
) -> list[Path]:
    """Returns the files that `generate_city` would change, without writing.

    The arguments are the same as those of `generate_city`.
    """
    world = Path(world)
    files = _rendered_files(world, progress, repair_stages)
    stale = _generated_files(world) - {world / name for name in files}
    changed = {
        world / name
        for name, text in files.items()
        if not (world / name).is_file()
        or (world / name).read_bytes() != text.encode()
    }
    return sorted(stale | changed)


def _generated_files(world: Path) -> set[Path]:
    """Returns the files in a world folder that the generator wrote."""
    return {
        *world.glob(stage_name("*")),
        *(world / MESH_FOLDER).glob("*.obj"),
        *world.glob(STRUCTURES_NAME),
    }
