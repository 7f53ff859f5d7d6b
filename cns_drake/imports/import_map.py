"""A city of somebody else's as a map folder, with stages and drives."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
import os
from pathlib import Path
import re
import shutil

import numpy as np
from shapely.geometry import Point
import yaml

from cns_drake.base.errors import InputError
from cns_drake.base.files import part_path, user_errors
from cns_drake.base.map_folder import MESH_FOLDER, STRUCTURES_NAME, stage_name
from cns_drake.city.generation.generate import (
    MAX_STRUCTURES,
    structure_table,
)
from cns_drake.city.generation.sdf import stage_sdf
from cns_drake.city.geometry.structures import (
    MeshShape,
    Model,
    Part,
    Structure,
)
from cns_drake.imports.building_years import stage_names, stands_at
from cns_drake.imports.drive_files import write_drives
from cns_drake.imports.drive_search import FreeDrive, find_drives
from cns_drake.imports.foreign_city import ForeignCity, Imported
from cns_drake.imports.free_space import (
    FreeSpace,
    find_free_space,
    surface_samples,
)
from cns_drake.imports.import_ground import Ground, feet_of, guess_ground
from cns_drake.imports.import_report import DriveOn, ImportOptions, ImportReport
from cns_drake.imports.import_structures import import_cityjson
from cns_drake.imports.near_drives import drive_along, keep_near
from cns_drake.imports.opendrive.town import build_town
from cns_drake.imports.opendrive.town_files import write_town
from cns_drake.imports.openstreetmap import import_openstreetmap
from cns_drake.imports.overview import draw_overview
from cns_drake.imports.street_drives import find_street_drives

# Of flat things on the ground every such corner helps to find its height.
_EVERY_CORNER = 7
# From the middle of a city [m].
_FARTHEST = 10_000.0


def import_city(
    source: Path,
    output: Path,
    options: ImportOptions,
    progress: Callable[[str], None] = lambda line: None,
) -> ImportReport:
    """Writes a map folder of a file.

    Args:
        source: CityJSON (.json, .jsonl), OpenStreetMap (.osm, .pbf) or
            OpenDRIVE (.xodr).
        output: the folder, which must not be there yet.
        options: what is taken.
        progress: takes one line at a time.

    Raises:
        InputError: if the file or the options cannot be used, or the folder
            is there or cannot be written.
    """
    stages = stage_names(options.years)
    is_roads = source.suffix == ".xodr"
    if is_roads and (options.years or options.lod is not None):
        option = "--years" if options.years else "--lod"
        raise InputError(f"{option}: {source} is a road network, without any")
    if is_roads and (options.along or options.within is not None):
        option = "--along" if options.along else "--within"
        raise InputError(f"{option}: {source} is a road network, taken whole")
    if os.path.lexists(output):
        raise InputError(f"{output}: is there already")
    name = output.resolve().name
    if not re.fullmatch(r"\w+", name, re.ASCII):
        raise InputError(
            f"--output: {name!r}: letters, digits and underscores only"
        )
    own = None if options.along is None else [drive_along(options.along)]
    progress(f"reading {source}")
    if is_roads:
        town = build_town(source, options.seed, progress)
        with _drafted(output) as draft:
            return write_town(draft, source, town, progress)
    city = _read(source, options)
    found = _together(city)
    if not found:
        raise InputError(f"{source}: no object has a surface")
    standing = [_standing(found, k, options) for k in range(len(stages))]
    ever = {one for some in standing for one in some}
    kept = [one for one in found if one in ever]
    if len(kept) >= MAX_STRUCTURES:
        raise InputError(
            f"{source}: {len(kept)} objects are more than instance ids can"
            f" count ({MAX_STRUCTURES})"
        )
    if not kept:
        raise InputError(f"{source}: nothing stands at any stage")
    progress(f"{len(kept)} structures; looking for streets")
    ground = _ground(kept)
    space = find_free_space(kept, ground)
    drives = own
    if drives is None:
        drives = _find_drives(city, space, options)
    if options.within is not None:
        if not drives:
            raise InputError("--within: no drive was found, give one: --along")
        kept = keep_near(kept, drives, options.within, city.faults)
        if not kept:
            raise InputError(
                f"--within: nothing stands within {options.within:g} m of "
                "the drives"
            )
        standing = [_standing(kept, k, options) for k in range(len(stages))]
        ground = _ground(kept)
    bottom = _bottom(kept, ground)
    with _drafted(output) as draft:
        _write_world(
            draft,
            source,
            [*bottom, *(one.structure for one in kept)],
            {
                stage: [*bottom, *(one.structure for one in some)]
                for stage, some in zip(stages, standing, strict=True)
            },
        )
        _write_facts(draft, source, city, options, stages)
        when = [f" in {year}" for year in options.years] or [""]
        routes = [
            np.column_stack([drive.waypoints, ground.height(drive.waypoints)])
            for drive in drives
        ]
        write_drives(draft, dict(zip(stages, when, strict=True)), routes)
        draw_overview(draft / "from_above.png", kept, space, drives)
    return ImportReport(
        kinds=dict(Counter(one.kind for one in kept)),
        triangles=sum(len(one.triangles) for one in kept),
        stages={
            stage: len(some)
            for stage, some in zip(stages, standing, strict=True)
        },
        undated=sum(one.year is None for one in found if _has_years(one)),
        drives=tuple(drive.length for drive in drives),
        faults=city.faults.rows(),
    )


@contextmanager
def _drafted(output: Path) -> Iterator[Path]:
    """Gives a folder of the same name, which takes the place when all is well.

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


def _read(source: Path, options: ImportOptions) -> ForeignCity:
    if source.suffix in (".json", ".jsonl"):
        return import_cityjson(source, options.lod, options.year_attribute)
    if source.suffix not in (".osm", ".pbf"):
        raise InputError(
            f"{source}: not CityJSON (.json, .jsonl), OpenStreetMap (.osm,"
            " .pbf) or OpenDRIVE (.xodr)"
        )
    if options.lod is not None:
        raise InputError(f"--lod: {source} has no levels of detail")
    return import_openstreetmap(source, options.year_attribute)


def _together(city: ForeignCity) -> list[Imported]:
    """Returns the structures of a city without those that lie far away."""
    if not city.structures:
        return []
    boxes = np.array(
        [
            (one.triangles.min(axis=(0, 1)), one.triangles.max(axis=(0, 1)))
            for one in city.structures
        ]
    )
    middle = np.median(boxes.mean(axis=1), axis=0)
    kept = []
    for one, reach in zip(
        city.structures, np.abs(boxes - middle).max(axis=(1, 2)), strict=True
    ):
        if reach <= _FARTHEST:
            kept.append(one)
        else:
            kind = f"object more than {_FARTHEST / 1000:g} km away, left out"
            city.faults.add(kind, one.structure.name)
    return kept


def _find_drives(
    city: ForeignCity, space: FreeSpace, options: ImportOptions
) -> list[FreeDrive]:
    """Returns drives in the lanes of streets, or else in free space."""
    side = options.drive_on
    if side is None:
        side = DriveOn.LEFT if city.keeps_left else DriveOn.RIGHT
    return find_street_drives(city.streets, space, side) or find_drives(space)


def _has_years(one: Imported) -> bool:
    """Tells whether a structure may be missing in a stage.

    Who tells no years at all knows them of buildings alone.
    """
    is_building = one.kind.startswith("Building")
    return not one.is_ground and (one.year is not None or is_building)


def _standing(
    found: Sequence[Imported], stage: int, options: ImportOptions
) -> list[Imported]:
    return [
        one
        for one in found
        if not _has_years(one)
        or stands_at(one.year, stage, options.years, options.undated)
    ]


def _ground(kept: Sequence[Imported]) -> Ground:
    corners = np.concatenate([one.triangles.reshape(-1, 3) for one in kept])
    terrain = [one for one in kept if one.kind == "TINRelief"]
    if terrain:
        feet = [one.triangles.reshape(-1, 3) for one in terrain]
    else:
        feet = [feet_of([o.triangles for o in kept if not o.is_ground])]
        feet += [
            one.triangles.reshape(-1, 3)[::_EVERY_CORNER]
            for one in kept
            if one.is_ground
        ]
    return guess_ground(np.concatenate(feet), corners)


def _bottom(kept: Sequence[Imported], ground: Ground) -> list[Structure]:
    """Returns the guessed ground, where the file has no terrain."""
    if any(one.kind == "TINRelief" for one in kept):
        return []
    taken = {one.structure.name for one in kept}
    name = "ground"
    while name in taken:
        name += "_"
    # Streets and water are to be seen, and not the guess above them.
    lowered = ground
    spacing = ground.cell / 2.0
    for one in kept:
        if one.is_ground:
            for points in surface_samples(one.triangles, spacing):
                lowered = lowered.below(points)
    model = Model(
        (Part("surface", MeshShape(name)),),
        {name: lowered.to_mesh()},
        Point(0.0, 0.0).buffer(1.0),
    )
    return [Structure(name, "terrain", model, (0.0, 0.0, 0.0))]


def _write_world(
    draft: Path,
    source: Path,
    structures: Sequence[Structure],
    stages: dict[str, list[Structure]],
) -> None:
    (draft / STRUCTURES_NAME).write_text(structure_table(structures), "utf-8")
    for stage, some in stages.items():
        text = stage_sdf(
            f"{draft.name}_{stage}",
            some,
            comment=f"Imported by cns-drake from {source.name}.",
        )
        (draft / stage_name(stage)).write_text(text, "utf-8")
    # Trees of a kind share theirs.
    meshes = {
        name: mesh
        for structure in structures
        for name, mesh in structure.model.meshes.items()
    }
    for name, mesh in meshes.items():
        path = draft / MESH_FOLDER / f"{name}.obj"
        path.write_text(mesh.to_obj(), "utf-8")


def _write_facts(
    draft: Path,
    source: Path,
    city: ForeignCity,
    options: ImportOptions,
    stages: Iterable[str],
) -> None:
    """Writes where the map comes from, and where it lies."""
    facts = {
        "source": source.name,
        "reference_system": city.reference_system or "not told",
        "origin": list(city.origin),
        "lod": options.lod if options.lod is not None else "highest",
        "years": dict(zip(stages, options.years, strict=False)),
        "left_out_or_repaired": {
            kind: number for kind, number, _ in city.faults.rows()
        },
    }
    comment = (
        "# Where this map comes from. A place of the map plus the origin is"
        " one of the\n# source [m].\n"
    )
    text = yaml.safe_dump(facts, sort_keys=False, allow_unicode=True)
    (draft / "import.yaml").write_text(comment + text, "utf-8")
