"""Writes the files of an imported city."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.artist import Artist
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
import numpy as np
import yaml

from cns_drake.city.generation.generate import structure_table
from cns_drake.city.generation.stage_sizes import stage_size, triangles_in
from cns_drake.city.generation.world_sdf import world_sdf
from cns_drake.city.geometry.structures import Structure
from cns_drake.imports.dressing.dressed_city import Dressing
from cns_drake.imports.drives.free_space import CELL, FreeSpace
from cns_drake.imports.drives.search import WaypointRoute
from cns_drake.imports.faces import joined
from cns_drake.imports.foreign_city import WATER, ForeignCity, Imported
from cns_drake.imports.options import (
    REPORT_NAME,
    ImportFaults,
    ImportOptions,
    ImportReport,
)
from cns_drake.imports.staged_city import StagedCity
from cns_drake.scene.map_folder import MESH_FOLDER, STRUCTURES_NAME, stage_name
from cns_drake.scene.semantics import CLASS_RGB

# Column of the structure table: the year in which a building was built.
YEAR_COLUMN = "built"
_CRUISE = 8.0  # [m/s]
_ACCELERATION = {"longitudinal_acceleration": 2.0, "lateral_acceleration": 2.5}
_DPI = 130
_INCHES = 9.0
_ROUTE_COLOURS = ("#d7191c", "#2c7bb6")
_ROUTE_WIDTHS = (5.0, 2.0)  # [pt]
_ROOM_COLOUR = "#ffd92f"
_ROOM_ALPHA = 0.6


def write_world(
    draft: Path,
    source: Path,
    city: StagedCity,
    bottom: Sequence[Structure],
    dressing: Dressing | None = None,
) -> dict[str, tuple[int, int]]:
    """Writes the stages of a map, their meshes and the structure table.

    Args:
        draft: folder of the map.
        source: imported file, named in comments.
        city: the structures of each stage.
        bottom: structures of the guessed ground, which are in all stages.
        dressing: details that were added to buildings and streets; None if no
            details were added.

    Returns:
        Name of a stage -> numbers of structures and of triangles in the stage.
    """
    structures = [*bottom, *(one.structure for one in city.kept)]
    versions = (
        one.structure for some in city.standing.values() for one in some
    )
    table = structure_table(structures, versions)
    if dressing is not None:
        names = [one.structure.name for one in city.kept]
        origins = [dressing.origins.get(name, "file") for name in names]
        table = with_column(table, "origin", ["guess"] * len(bottom) + origins)
    years = [one.year for one in city.kept]
    if any(years):
        texts = ["" if year is None else str(year) for year in years]
        table = with_column(table, YEAR_COLUMN, [""] * len(bottom) + texts)
    (draft / STRUCTURES_NAME).write_text(table, "utf-8")
    triangles: dict[str, int] = {}
    for structure in structures:
        for name, mesh in structure.model.meshes.items():
            # Trees of one kind share their meshes.
            if name not in triangles:
                text = mesh.to_obj()
                path = draft / MESH_FOLDER / f"{name}.obj"
                path.write_text(text, "utf-8")
                triangles[name] = triangles_in(text)
    sizes = {}
    for stage, some in city.standing.items():
        standing = [*bottom, *(one.structure for one in some)]
        text = world_sdf(
            f"{draft.name}_{stage}",
            standing,
            comment=f"Imported by cns-drake from {source.name}.",
        )
        (draft / stage_name(stage)).write_text(text, "utf-8")
        sizes[stage] = stage_size(standing, triangles)
    return sizes


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
    """Writes the facts of an import to `import.yaml` in the map's folder.

    Args:
        draft: folder of the map.
        source: file that is imported.
        facts: facts to record, by name.
        faults: counts of repaired and omitted parts.
        comment: first lines of the file.
    """
    if "axes" in facts:
        comment += (
            "# Places of the source are brought to metres east, north and up"
            " first.\n"
        )
    counts = {kind: number for kind, number, _ in faults.rows()}
    text = yaml.safe_dump(
        {"source": source.name, **facts, "left_out_or_repaired": counts},
        sort_keys=False,
        allow_unicode=True,
    )
    (draft / "import.yaml").write_text(comment + text, "utf-8")


def write_report(draft: Path, report: ImportReport) -> None:
    """Writes all counts of an import to `import.txt` in the map's folder."""
    lines = [f"{kind}: {number}" for kind, number in report.kinds.items()]
    lines += [
        f"{kind}: {number}, such as {example}"
        for kind, number, example in report.faults
    ]
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
    for number, (stage, when) in enumerate(stages.items()):
        # The query drive is in the last stage. Its route is not that of the
        # database drives.
        letters = "ab"[: len(routes)]
        if number < len(stages) - 1:
            letters = letters[::-1]
        for kind, letter in zip(("sequence", "other"), letters, strict=False):
            scenario = {
                "map": ".",
                "stage": stage,
                "title": f"Route {letter} through {folder.name}{when}",
                "waypoints": f"route_{letter}.csv",
                "speeds": {"cruise": speeds[letter], **_ACCELERATION},
            }
            text = yaml.safe_dump(scenario, sort_keys=False)
            (folder / f"{kind}_{stage}.yaml").write_text(text, "utf-8")


def draw_overview(
    path: Path,
    structures: Sequence[Imported],
    space: FreeSpace | None,
    drives: Sequence[WaypointRoute],
) -> None:
    """Draws a map's structures, the free space for a car and the drives.

    Where two drives share a street, the second drive is a thinner line on top
    of the first, so that both can be seen.

    Args:
        path: image file to write.
        structures: the structures.
        space: the free space; None to draw none.
        drives: the drives, at most two.
    """
    corners = joined(one.triangles for one in structures).reshape(-1, 3)
    low, high = corners[:, :2].min(axis=0), corners[:, :2].max(axis=0)
    if space is not None:
        low = space.low
        high = low + CELL * np.array(space.clearance.shape[::-1])
    size = _INCHES * (high - low) / (high - low).max()
    figure = Figure(layout="constrained")
    axes = figure.subplots()
    legend: dict[str, Artist] = {}
    classes: dict[str, Artist] = {}
    for is_ground in (True, False):
        alike: dict[tuple[float, float, float], list[np.ndarray]] = {}
        for one in structures:
            if one.is_ground == is_ground and one.kind != "TINRelief":
                colour = _colour(one)
                alike.setdefault(colour, []).append(one.triangles)
                name = one.structure.semantic_class
                if name == "building":
                    name = "building, any colour"
                elif colour == WATER:
                    name = "water"
                classes.setdefault(name, Patch(facecolor=colour))
        for colour, triangles in alike.items():
            # The library takes an array faster than a list, but its type hints
            # do not allow it.
            corners_xy: Any = np.concatenate(triangles)[:, :, :2]
            axes.add_collection(
                PolyCollection(
                    corners_xy,
                    facecolors=[colour],
                    # Otherwise fine lines show between triangles.
                    edgecolors="face",
                    linewidths=0.3,
                )
            )
    extent = (low[0], high[0], low[1], high[1])
    if space is not None:
        room = np.where(space.clearance >= space.least, 1.0, np.nan)
        # This lies above the structures and below the lines.
        axes.imshow(
            room,
            origin="lower",
            extent=extent,
            cmap=ListedColormap([_ROOM_COLOUR]),
            alpha=_ROOM_ALPHA,
            zorder=1.5,
        )
        classes["room for a car"] = Patch(
            facecolor=_ROOM_COLOUR, alpha=_ROOM_ALPHA
        )
    for letter, drive, rgb, width in zip(
        "ab", drives, _ROUTE_COLOURS, _ROUTE_WIDTHS, strict=False
    ):
        (line,) = axes.plot(*drive.path.T, color=rgb, linewidth=width)
        legend[f"drive {letter}, {drive.length:.0f} m"] = line
        for end, marker, name in ((0, "o", "start"), (-1, "s", "end")):
            axes.plot(
                *drive.path[end],
                marker,
                color=rgb,
                markersize=2 * width + 3,
                markeredgecolor="white",
            )
            legend[name] = Line2D(
                [], [], linestyle="", marker=marker, color="black"
            )
    axes.set(xlim=extent[:2], ylim=extent[2:], xlabel="x [m]", ylabel="y [m]")
    axes.set_aspect("equal")
    axes.grid(alpha=0.3)
    legend |= classes
    wide = max(size[0] + 0.8, 4.0)
    columns = int(wide / 2)
    rows = -(-len(legend) // columns)
    figure.set_size_inches(wide, size[1] + 0.8 + 0.2 * rows)
    figure.legend(
        legend.values(),
        legend.keys(),
        loc="outside lower center",
        ncols=columns,
    )
    figure.savefig(path, dpi=_DPI, metadata={"Software": None})


def _colour(one: Imported) -> tuple[float, float, float]:
    part = one.structure.model.parts[0]
    if one.structure.semantic_class == "vegetation":
        return CLASS_RGB["vegetation"]
    return part.rgb or CLASS_RGB[one.structure.semantic_class]
