"""A town on an imported road network as the files of a map."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
import re

import numpy as np
import shapely
import yaml

from cns_drake.base.map_folder import LANES_NAME, MESH_FOLDER, stage_name
from cns_drake.city.generation.generate import render_stages
from cns_drake.city.geometry.polygons import polygons_of
from cns_drake.city.geometry.structures import MeshShape, Structure
from cns_drake.imports.drive_files import write_drives
from cns_drake.imports.foreign_city import Imported
from cns_drake.imports.import_report import ImportReport
from cns_drake.imports.map_files import OF_BOX, triangles_in
from cns_drake.imports.opendrive.town import Town

_CROWN = 1.5  # [m]
# Limits of the speed of a drive [m/s].
_SPEEDS = (3.0, 12.0)
# Classes in the picture from above; small things would not show.
_SHOWN = (
    "road",
    "parking",
    "sidewalk",
    "other-ground",
    "building",
    "vegetation",
)


def write_town(
    draft: Path,
    source: Path,
    town: Town,
    progress: Callable[[str], None],
) -> tuple[ImportReport, dict[str, tuple[int, int]]]:
    """Writes all files of a town.

    Args:
        draft: the map's folder, with the map's name; it exists.
        source: the file of the roads.
        town: to write.
        progress: takes one line at a time.

    Returns:
        What was imported; stage -> its numbers of structures and triangles.

    Raises:
        InputError: if it has more structures than instance ids can count.
    """
    stages = town.stages.stages
    files = render_stages(
        draft.name,
        town.city,
        town.stages,
        stages,
        source,
        progress,
        origin=f"Imported by cns-drake from {source.name}.",
    )
    (draft / MESH_FOLDER).mkdir(exist_ok=True)
    for name, text in files.items():
        (draft / name).write_text(text, "utf-8")
    if town.lanes is not None:
        (draft / LANES_NAME).write_text(town.lanes, "utf-8")
    _write_facts(draft, source, town)
    write_drives(
        draft,
        {
            stage: "" if stage == list(stages)[-1] else ", not all of it built"
            for stage in stages
        },
        [drive.waypoints for drive in town.drives],
        [
            float(np.clip(drive.limit or _SPEEDS[1], *_SPEEDS))
            for drive in town.drives
        ],
    )
    # Slow to import.
    from cns_drake.imports.overview import draw_overview

    draw_overview(
        draft / "from_above.png",
        list(_seen_from_above(town.city.structures)),
        None,
        town.drives,
    )
    sizes = _sizes(files, stages)
    report = ImportReport(
        kinds=town.kinds,
        triangles=sum(map(_triangles, town.city.structures)),
        stages={stage: size[0] for stage, size in sizes.items()},
        undated=0,
        dated=0,
        drives=tuple(drive.length for drive in town.drives),
        faults=town.faults.rows(),
    )
    return report, sizes


def _sizes(
    files: Mapping[str, str], stages: Iterable[str]
) -> dict[str, tuple[int, int]]:
    """Returns stage -> its numbers of structures and triangles.

    Args:
        files: path -> text, of the stages and their meshes.
        stages: their names.
    """
    triangles = {
        name: triangles_in(text)
        for name, text in files.items()
        if name.endswith(".obj")
    }
    sizes = {}
    for stage in stages:
        text = files[stage_name(stage)]
        structures = set(re.findall('visual name="([^"/]+)', text))
        meshes = re.findall("<uri>([^<]+)</uri>", text)
        boxes = OF_BOX * text.count("<box>")
        sizes[stage] = (
            len(structures),
            boxes + sum(map(triangles.__getitem__, meshes)),
        )
    return sizes


def _write_facts(draft: Path, source: Path, town: Town) -> None:
    facts = {
        "source": source.name,
        "reference_system": town.roads.reference_system or "unknown",
        "origin": list(town.roads.origin),
        "seed": town.seed,
        "stages": {
            stage: plan.story for stage, plan in town.stages.stages.items()
        },
        "left_out_or_repaired": {
            kind: number for kind, number, _ in town.faults.rows()
        },
    }
    comment = (
        "# Where the roads of this map come from; all else is drawn at random."
        "\n# A place of the map plus the origin is one of the source [m].\n"
    )
    text = yaml.safe_dump(facts, sort_keys=False, allow_unicode=True)
    (draft / "import.yaml").write_text(comment + text, "utf-8")


def _triangles(structure: Structure) -> int:
    count = 0
    for part in structure.model.parts:
        if isinstance(part.shape, MeshShape):
            count += structure.model.meshes[part.shape.mesh].num_triangles
        else:
            count += OF_BOX
    return count


def _seen_from_above(structures: Iterable[Structure]) -> Iterable[Imported]:
    """Yields footprints as triangles."""
    for one in structures:
        if one.semantic_class not in _SHOWN:
            continue
        area = one.footprint_W
        if one.semantic_class == "vegetation":
            # About the size of the crown.
            area = area.buffer(_CROWN)
        pieces = polygons_of(area)
        cut = shapely.constrained_delaunay_triangles(
            shapely.multipolygons(pieces)
        )
        corners = [
            shapely.get_coordinates(triangle)[:3]
            for triangle in shapely.get_parts(cut)
        ]
        if corners:
            xy = np.array(corners)
            z = np.zeros((*xy.shape[:2], 1))
            yield Imported(one, "", None, np.concatenate([xy, z], axis=2))
