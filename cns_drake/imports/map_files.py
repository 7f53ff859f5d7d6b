"""The files of an imported city."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import chain
import os
from pathlib import Path
import shutil

import yaml

from cns_drake.base.files import part_path, user_errors
from cns_drake.base.jobs.side_by_side import side_by_side
from cns_drake.base.map_folder import MESH_FOLDER, STRUCTURES_NAME, stage_name
from cns_drake.city.generation.sdf import stage_sdf
from cns_drake.city.generation.structure_rows import structure_table
from cns_drake.city.geometry.mesh import Mesh
from cns_drake.city.geometry.structures import (
    BoxShape,
    MeshShape,
    Structure,
)
from cns_drake.imports.dressing.whole_city import Dressing
from cns_drake.imports.foreign_city import ForeignCity
from cns_drake.imports.grown_city import Growth
from cns_drake.imports.import_report import ImportOptions
from cns_drake.imports.staged_city import StagedCity

OF_BOX = 12  # triangles
# Meshes are written in this many parts, side by side.
_PARTS = 12


@contextmanager
def map_draft(output: Path) -> Iterator[Path]:
    """Yields a draft folder of the same name; it takes its place at success.

    Raises:
        InputError: if it cannot be written.
    """
    part = part_path(output)
    draft = part / output.resolve().name
    try:
        with user_errors(output):
            shutil.rmtree(part, ignore_errors=True)
            (draft / MESH_FOLDER).mkdir(parents=True)
            yield draft
            os.replace(draft, output)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def write_world(
    draft: Path,
    source: Path,
    city: StagedCity,
    bottom: Sequence[Structure],
    dressing: Dressing | None = None,
    others: Sequence[Callable[[], None]] = (),
) -> dict[str, tuple[int, int]]:
    """Writes the stages, their meshes and the table of structures.

    Args:
        draft: the map's folder, with the map's name.
        source: the file that the city was read from.
        city: all structures.
        bottom: the ground below them, at all stages.
        dressing: the added details, if the city was dressed.
        others: write further files, side by side with these.

    Returns:
        Stage -> its numbers of structures and triangles.
    """
    structures = [*bottom, *(one.structure for one in city.kept)]

    def write_stages() -> None:
        table = structure_table(structures)
        if dressing is not None:
            names = [one.structure.name for one in city.kept]
            origins = [dressing.origins.get(name, "file") for name in names]
            table = with_column(
                table, "origin", ["guess"] * len(bottom) + origins
            )
        (draft / STRUCTURES_NAME).write_text(table, "utf-8")
        for stage, some in city.standing.items():
            text = stage_sdf(
                f"{draft.name}_{stage}",
                [*bottom, *(one.structure for one in some)],
                comment=f"Imported by cns-drake from {source.name}.",
            )
            (draft / stage_name(stage)).write_text(text, "utf-8")

    # Trees of a kind share their meshes.
    meshes = {
        name: mesh
        for structure in structures
        for name, mesh in structure.model.meshes.items()
    }
    parts = [list(meshes.items())[k::_PARTS] for k in range(_PARTS)]
    written = side_by_side(
        [
            *others,
            write_stages,
            *(partial(_write_meshes, draft / MESH_FOLDER, p) for p in parts),
        ]
    )
    triangles = dict(chain.from_iterable(written[len(others) + 1 :]))
    return {
        stage: _size([*bottom, *(one.structure for one in some)], triangles)
        for stage, some in city.standing.items()
    }


def _write_meshes(
    folder: Path, meshes: Iterable[tuple[str, Mesh]]
) -> list[tuple[str, int]]:
    """Writes meshes; returns their names and numbers of triangles."""
    found = []
    for name, mesh in meshes:
        text = mesh.to_obj()
        (folder / f"{name}.obj").write_text(text, "utf-8")
        found.append((name, triangles_in(text)))
    return found


def triangles_in(obj: str) -> int:
    """Returns the number of triangles of a mesh's faces."""
    faces = obj[obj.find("\nf ") :]
    # A face of three corners has three spaces, and each further corner one.
    return faces.count(" ") - 2 * faces.count("f")


def _size(
    structures: Sequence[Structure], triangles: Mapping[str, int]
) -> tuple[int, int]:
    """Returns the numbers of structures with a surface, and of triangles."""
    shapes = [p.shape for one in structures for p in one.model.parts]
    return sum(bool(one.model.parts) for one in structures), sum(
        triangles[shape.mesh] if isinstance(shape, MeshShape) else OF_BOX
        for shape in shapes
        if isinstance(shape, MeshShape | BoxShape)
    )


def write_facts(
    draft: Path,
    source: Path,
    city: ForeignCity,
    options: ImportOptions,
    stages: Sequence[str],
    growth: Growth | None,
    dressing: Dressing | None = None,
) -> None:
    """Writes the source of the map, its place, and counts of drawn parts."""
    facts = {
        "source": source.name,
        "reference_system": city.reference_system or "unknown",
        **({"axes": list(city.axes)} if city.axes else {}),
        "origin": list(city.origin),
        "lod": options.lod if options.lod is not None else "highest",
        "years": dict(zip(stages, options.years, strict=False)),
        **_drawn(options, growth),
        **({"dressing": dict(dressing.facts)} if dressing else {}),
        "left_out_or_repaired": {
            kind: number for kind, number, _ in city.faults.rows()
        },
    }
    comment = (
        "# Where this map comes from. A place of the map plus the origin is"
        " one of the\n# source [m].\n"
    )
    if city.axes:
        comment += (
            "# Places of the source are brought to metres east, north and up"
            " first.\n"
        )
    text = yaml.safe_dump(facts, sort_keys=False, allow_unicode=True)
    (draft / "import.yaml").write_text(comment + text, "utf-8")


def _drawn(options: ImportOptions, growth: Growth | None) -> dict:
    """Returns the counts of drawn parts, if there are any."""
    if growth is None:
        return {}
    return {
        "first_stage_by_lot": {
            "grow": options.grow,
            "seed": options.seed,
            "missing": list(growth.missing),
            "part_of_height": growth.lower,
            **({"gone_since": list(growth.gone)} if growth.gone else {}),
        }
    }


def with_column(table: str, name: str, values: Sequence[str]) -> str:
    """Returns a CSV table with one more column, at its end."""
    lines = table.splitlines()
    rows = zip(lines, [name, *values], strict=True)
    return "".join(f"{line},{value}\n" for line, value in rows)
