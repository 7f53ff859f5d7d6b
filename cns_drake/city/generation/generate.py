"""Writes the generated files of a city, or compares them with the folder."""

from collections.abc import Callable
from pathlib import Path

from cns_drake.base import InputError, doing, user_errors, write_text
from cns_drake.city.generation.city_structures import City, make_city
from cns_drake.city.generation.renaming import find_renaming, renamed_text
from cns_drake.city.generation.rendering import render_city
from cns_drake.scene import (
    MESH_FOLDER,
    STAGES_NAME,
    STRUCTURES_NAME,
    stage_name,
)


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
