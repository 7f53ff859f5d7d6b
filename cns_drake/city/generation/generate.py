"""Writes a city's stages, meshes and table of structures."""

from collections import defaultdict
from collections.abc import Callable, Iterable
from pathlib import Path

from cns_drake.base.complete_files import write_text
from cns_drake.base.csv_files import csv_text
from cns_drake.base.errors import InputError
from cns_drake.base.files import user_errors
from cns_drake.base.progress import doing
from cns_drake.city.generation.city_structures import City, make_city
from cns_drake.city.generation.renaming import find_renaming, renamed_text
from cns_drake.city.generation.stage_sizes import stage_size, triangles_in
from cns_drake.city.generation.world_sdf import world_sdf
from cns_drake.city.geometry.mesh import Mesh
from cns_drake.city.geometry.models import MeshShape
from cns_drake.city.geometry.structures import Structure
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
from cns_drake.scene.semantics import CLASS_IDS


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
        files[stage_name(stage)] = world_sdf(
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
