"""Writes the files of an imported city."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import yaml

from worlds.city import stage_size, structures_csv, triangles_in, world_sdf
from worlds.imports.dressing.dressed_city import Dressing
from worlds.imports.faults import ImportFaults
from worlds.imports.foreign_city import ForeignCity
from worlds.imports.options import ImportOptions
from worlds.imports.report import REPORT_NAME, ImportReport
from worlds.imports.staged_city import StagedCity
from worlds.maps import IMPORT_NAME, MESH_FOLDER, MapFolder, stage_name
from worlds.shapes import STRUCTURES_NAME, Structure

# Column of the structure table: the year in which a building was built.
YEAR_COLUMN = "built"
# Speed of drives without a speed limit [m/s].
_CRUISE = 8.0
# Greatest accelerations of a drive [m/s^2].
_ACCELERATION = {"longitudinal_acceleration": 2.0, "lateral_acceleration": 2.5}


def write_world(
    draft: Path,
    source: Path,
    city: StagedCity,
    guessed_ground: Sequence[Structure],
    dressing: Dressing | None = None,
) -> dict[str, tuple[int, int]]:
    """Writes the stages of a map, their meshes and the structure table.

    Args:
        draft: folder of the map.
        source: imported file, named in comments.
        city: the structures of each stage.
        guessed_ground: structures of the ground that the file does not have,
            which are in all stages.
        dressing: details that were added to buildings and streets; None if no
            details were added.

    Returns:
        Name of a stage -> numbers of structures and of triangles in the stage.
    """
    table = _structure_table(city, guessed_ground, dressing)
    (draft / STRUCTURES_NAME).write_text(table, "utf-8")
    triangles = _write_meshes(
        draft, [*guessed_ground, *(kept.structure for kept in city.kept)]
    )
    sizes = {}
    for stage, standing in city.standing.items():
        structures = [
            *guessed_ground,
            *(member.structure for member in standing),
        ]
        text = world_sdf(
            f"{draft.name}_{stage}",
            structures,
            comment=f"Imported by cns-drake from {source.name}.",
        )
        (draft / stage_name(stage)).write_text(text, "utf-8")
        sizes[stage] = stage_size(structures, triangles)
    return sizes


def _structure_table(
    city: StagedCity,
    guessed_ground: Sequence[Structure],
    dressing: Dressing | None,
) -> str:
    """Returns the structure table of a city, as the text of a CSV file.

    There is a column for the origin of structures, and a city with years of
    construction has a column for these. The arguments are as for `write_world`.
    """
    table = structures_csv(
        [*guessed_ground, *(kept.structure for kept in city.kept)],
        (
            member.structure
            for standing in city.standing.values()
            for member in standing
        ),
    )
    origins = {} if dressing is None else dressing.origins
    names = [kept.structure.name for kept in city.kept]
    cells = ["guess"] * len(guessed_ground)
    cells += [origins.get(name, "file") for name in names]
    table = with_column(table, "origin", cells)
    years = [kept.year for kept in city.kept]
    if any(years):
        cells = [""] * len(guessed_ground)
        cells += ["" if year is None else str(year) for year in years]
        table = with_column(table, YEAR_COLUMN, cells)
    return table


def _write_meshes(
    draft: Path, structures: Iterable[Structure]
) -> dict[str, int]:
    """Writes the meshes of structures; returns mesh -> number of triangles."""
    triangles: dict[str, int] = {}
    for structure in structures:
        for name, mesh in structure.model.meshes.items():
            # Trees of one kind share their meshes.
            if name not in triangles:
                text = mesh.to_obj()
                path = draft / MESH_FOLDER / f"{name}.obj"
                path.write_text(text, "utf-8")
                triangles[name] = triangles_in(text)
    return triangles


def city_facts(
    city: ForeignCity,
    options: ImportOptions,
    stages: Sequence[str],
    changes: Mapping[str, object] | None,
    dressing: Dressing | None = None,
) -> dict:
    """Returns facts about an imported map, as a mapping.

    The facts are the reference system, the origin, the level of detail and the
    years of the stages, and the facts from `changes` and `dressing`, if given.

    Args:
        city: the city as in its file.
        options: options of the import.
        stages: names of the stages.
        changes: facts about the random changes in an additional first stage;
            None if there is no such stage.
        dressing: details that were added to buildings and streets; None if
            there are none.
    """
    facts: dict[str, object] = {
        "reference_system": city.reference_system or "unknown",
        **({"axes": list(city.axes)} if city.axes else {}),
        "origin": list(city.origin),
        "lod": options.lod if options.lod is not None else "highest",
        "years": dict(zip(stages, options.years, strict=False)),
    }
    if changes is not None:
        facts["first_stage_at_random"] = {
            "grow": options.grow,
            "seed": options.seed,
            **changes,
        }
    if dressing is not None:
        facts["dressing"] = dict(dressing.facts)
    return facts


def write_facts(
    draft: Path,
    source: Path,
    facts: Mapping[str, object],
    faults: ImportFaults,
    comment: str = "# Where this map comes from. A place of the map plus the"
    " origin is one of the\n# source [m].\n",
) -> None:
    """Writes the facts of an import to `import.yaml` in the map's folder."""
    if "axes" in facts:
        comment += (
            "# Places of the source are brought to metres east, north and up"
            " first.\n"
        )
    counts = {fault.kind: fault.number for fault in faults.rows()}
    text = yaml.safe_dump(
        {"source": source.name, **facts, "left_out_or_repaired": counts},
        sort_keys=False,
        allow_unicode=True,
    )
    (draft / IMPORT_NAME).write_text(comment + text, "utf-8")


def write_report(draft: Path, report: ImportReport) -> None:
    """Writes all counts of an import to `import.txt` in the map's folder."""
    lines = [report.told_built()]
    lines += [f"{kind}: {number}" for kind, number in report.kinds.items()]
    lines += [
        f"{fault.kind}: {report.told(fault)}, such as {fault.example}"
        for fault in report.faults
    ]
    lines += report.parts
    (draft / REPORT_NAME).write_text("\n".join([*lines, ""]), "utf-8")


def with_column(table: str, name: str, values: Sequence[str]) -> str:
    """Returns a CSV table with one more column on the right.

    `name` is the head of the column, and `values` are its other cells.
    """
    lines = table.splitlines()
    rows = zip(lines, [name, *values], strict=True)
    return "".join(f"{line},{value}\n" for line, value in rows)


def write_drives(
    folder: Path,
    stages: Mapping[str, str],
    routes: Sequence[np.ndarray],
    cruise: Sequence[float] = (_CRUISE, _CRUISE),
) -> None:
    """Writes the routes of a map, and a scenario for each route and stage.

    The drive of the last stage, which is the query, takes the first route. The
    drives of earlier stages take the second route, if there is one. A stage's
    other drive takes the other route.

    Args:
        folder: folder of the map.
        stages: name of a stage -> words that end the titles of its drives, such
            as the year.
        routes: waypoints (N, 3) of at most two routes [m].
        cruise: speed on each route [m/s].
    """
    for letter, waypoints in zip("ab", routes, strict=False):
        rows = [f"{x:.3f},{y:.3f},{z:.3f}" for x, y, z in waypoints]
        text = "\n".join(["x,y,z", *rows, ""])
        (folder / f"route_{letter}.csv").write_text(text, "utf-8")
    speeds = dict(zip("ab", cruise, strict=False))
    map_folder = MapFolder(folder)
    for number, (stage, when) in enumerate(stages.items()):
        letters = "ab"[: len(routes)]
        if number < len(stages) - 1:
            letters = letters[::-1]
        paths = map_folder.drive(stage), map_folder.other_drive(stage)
        for path, letter in zip(paths, letters, strict=False):
            scenario = {
                "map": ".",
                "stage": stage,
                "title": f"Route {letter} through {folder.name}{when}",
                "waypoints": f"route_{letter}.csv",
                "speeds": {"cruise": speeds[letter], **_ACCELERATION},
            }
            text = yaml.safe_dump(scenario, sort_keys=False)
            path.write_text(text, "utf-8")
