"""Writes the files of a town that was built on an imported road network."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from cns_drake.city import Structure, render_stages, surface_mesh
from cns_drake.imports import map_files, overview
from cns_drake.imports.imported_objects import ImportedObject
from cns_drake.imports.opendrive.town import Town
from cns_drake.imports.report import ImportReport
from cns_drake.scene import MESH_FOLDER

# About the radius of a tree's crown, in pictures [m].
_CROWN_RADIUS = 1.5
# Side of the squares into which footprints are divided, in pictures [m].
_TILE = 20.0
# Least and greatest speed of a drive [m/s].
_SPEEDS = (3.0, 12.0)
# Classes that the picture from above shows; small things could not be seen.
_SHOWN_CLASSES = (
    "road",
    "parking",
    "sidewalk",
    "other-ground",
    "building",
    "vegetation",
)


def write_town(
    draft: Path, source: Path, town: Town
) -> tuple[ImportReport, dict[str, tuple[int, int]]]:
    """Writes all files of a town to a map folder.

    Returns:
        What was imported, and name of a stage -> counts of its structures and
        of its triangles.

    Raises:
        InputError: the town has more structures than there are instance ids.
    """
    stages = town.stages.stages
    files, sizes = render_stages(
        draft.name,
        town.city,
        town.stages,
        stages,
        source,
        origin=f"Imported by cns-drake from {source.name}.",
    )
    (draft / MESH_FOLDER).mkdir(exist_ok=True)
    for name, text in files.items():
        (draft / name).write_text(text, "utf-8")
    map_files.write_facts(
        draft,
        source,
        {
            "reference_system": town.roads.reference_system or "unknown",
            "origin": list(town.roads.origin),
            "seed": town.seed,
            "stages": {name: plan.story for name, plan in stages.items()},
        },
        town.faults,
        "# Where the roads of this map come from; all else is random."
        "\n# A place of the map plus the origin is one of the system [m].\n",
    )
    _write_drives(draft, town)
    overview.draw_overview(
        draft / "from_above.png",
        list(_seen_from_above(town.city.structures)),
        None,
        town.drives,
    )
    return _report_of(town, sizes), sizes


def _write_drives(draft: Path, town: Town) -> None:
    """Writes the drives of a town, at the speed limit of their roads."""
    stages = list(town.stages.stages)
    map_files.write_drives(
        draft,
        {
            stage: "" if stage == stages[-1] else ", not all of it built"
            for stage in stages
        },
        [drive.waypoints for drive in town.drives],
        [
            float(np.clip(drive.limit or _SPEEDS[1], *_SPEEDS))
            for drive in town.drives
        ],
    )


def _report_of(
    town: Town, sizes: Mapping[str, tuple[int, int]]
) -> ImportReport:
    return ImportReport(
        kinds=town.kinds,
        triangles=sum(
            structure.model.num_triangles for structure in town.city.structures
        ),
        stages={stage: size[0] for stage, size in sizes.items()},
        undated=0,
        dated=0,
        drives=tuple(drive.length for drive in town.drives),
        faults=town.faults.rows(),
        parts=town.faults.parts(),
    )


def _seen_from_above(
    structures: Iterable[Structure],
) -> Iterable[ImportedObject]:
    """Yields the footprints of structures as flat triangles."""
    for structure in structures:
        if structure.semantic_class not in _SHOWN_CLASSES:
            continue
        area = structure.footprint_W
        if structure.semantic_class == "vegetation":
            area = area.buffer(_CROWN_RADIUS)
        mesh = surface_mesh(area, 0.0, _TILE)
        if mesh.num_triangles:
            triangles = mesh.vertices[mesh.triangles()]
            yield ImportedObject(structure, "", None, triangles)
