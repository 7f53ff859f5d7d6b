"""The command `import`, which makes a map from data of a real city."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
import shlex
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from evaluation.base import (
    InputError,
    ended_by_interrupts,
    errors_at_option,
    natural_key,
    note,
    shared_options,
    terminal,
    whole_number,
)

if TYPE_CHECKING:
    from worlds.imports import ImportOptions, ImportReport

GROUP = "Make cities"

# Kinds of structures and of faults that a report names.
_SHOWN = 5


def import_(
    source: Annotated[list[str], typer.Argument(metavar="FILE")],
    output: Annotated[Path, typer.Option()],
    years: Annotated[list[int] | None, typer.Option(metavar="YEAR ...")] = None,
    year_attribute: Annotated[str | None, typer.Option(metavar="NAME")] = None,
    undated: Literal["first", "last", "never"] = "first",
    lod: float | None = None,
    seed: Annotated[int, typer.Option(min=0)] = 0,
    along: Annotated[Path | None, typer.Option(metavar="WAYPOINTS")] = None,
    within: Annotated[
        float | None, typer.Option(min=1.0, metavar="METRES")
    ] = None,
    drive_on: Literal["right", "left"] | None = None,
    grow: Annotated[
        float | None, typer.Option(min=0.01, max=0.9, metavar="PART")
    ] = None,
    plain: Annotated[bool, typer.Option("--plain")] = False,
    json: shared_options.Json = False,
) -> None:
    """Make a map from data of a real city.

    Writes the stages of the map, a picture of the map from above, and two
    drives along the map's streets.

    Args:
        source: File of the city: CityJSON (.json, .jsonl), OpenDRIVE (.xodr),
            OpenStreetMap (.osm, .pbf).
        output: Folder of the map to write; its name becomes the map's name.
        years: Years for which to make stages. The stage of a year contains the
            buildings that were built in that year or earlier.
        year_attribute: Name of the file's attribute that contains each
            building's year of construction. By default the command tries the
            usual names.
        undated: Stages that contain the buildings without a year of
            construction: all stages (first), only the last stage (last), or no
            stage (never).
        lod: Level of detail (LoD) at which buildings are read from CityJSON,
            such as 1.2; by default the highest level that each building has.
        seed: Seed of all random choices: which buildings change (--grow), and
            which details are added. For an OpenDRIVE file, the whole city
            depends on it.
        along: CSV file with the path of a drive of your own: columns x and y in
            the frame of the map [m]. It replaces both drives.
        within: Greatest distance of structures from the drives [m]; what lies
            beyond is left out, to save memory.
        drive_on: Side of the street on which cars drive; by default the side
            that the file names, or right if the file names none.
        grow: Share of today's buildings, from 0.01 to 0.9, that are missing or
            lower in the first stage, by default 0.3; for an OpenDRIVE file, the
            share that is missing, farthest east, by default 0.35. Not with
            --years or --plain.
        plain: Do not add windows, lamps, parked cars and other details that the
            file does not contain.

    Example:
        cns-drake import delft.city.jsonl \\
            --years 1930 1970 2000 2020 --output delft
    """
    # The years that follow the first of --years come as arguments.
    paths = [word for word in source if not word.isdecimal()]
    more = [
        whole_number(word, "--years") for word in source if word.isdecimal()
    ]
    if len(paths) != 1 or (more and not years):
        raise InputError(f"give one file, not {' '.join(source)}")
    path = Path(paths[0])
    stages = (*(years or ()), *more)
    if plain and grow is not None:
        raise InputError(
            "--grow: not with --plain, which adds nothing at random"
        )
    with ended_by_interrupts("cns-drake"):
        from cns_drake.scenarios import write_table
        from worlds.imports import ImportOptions, import_city, with_usual_growth

    options = ImportOptions(
        stages,
        year_attribute,
        undated,
        lod,
        seed,
        along,
        within,
        drive_on,
        grow,
        dressed=not plain,
    )
    options = with_usual_growth(path, options)
    with errors_at_option("--output", "output"):
        report = import_city(
            path,
            output,
            options,
            finish=write_table,
        )
    for line in _shortcomings(report, output, options):
        note(f"{output}: {line}")
    values = {
        "output": str(output),
        "structures": report.kinds,
        "triangles": report.triangles,
        "stages": report.stages,
        "undated": report.undated,
        "drives": list(report.drives),
        "faults": {fault.kind: fault.number for fault in report.faults},
    }
    terminal.show(
        values, _report_rows(report, output, options.years), json=json
    )


def _shortcomings(
    report: ImportReport, output: Path, options: ImportOptions
) -> Iterator[str]:
    """Yields advice on what a study of the map would lack."""
    waypoints = (
        f"draw waypoints on {output / 'from_above.png'} (docs/imports.md)"
    )
    if not report.drives:
        yield f"no street wide and long enough was found; {waypoints}"
    elif len(report.drives) == 1 and options.along is None:
        yield f"no second route shares a part of the first; {waypoints}"
    if len(report.stages) == 1:
        yield "there is only one stage; give --years or --grow to study change"
    elif options.years and (
        report.undated > report.dated or len(set(report.stages.values())) == 1
    ):
        numbers = ", ".join(map(str, report.stages.values()))
        yield (
            f"{report.dated} buildings have a year, {report.undated} have none,"
            f" and the stages have {numbers} structures; in place of --years,"
            " --grow samples a change at random"
        )


def _report_rows(
    report: ImportReport, output: Path, years: tuple[int, ...]
) -> Iterator[tuple[str, str]]:
    """Yields lines with the most important numbers, and the next command."""
    from worlds.imports import REPORT_NAME
    from worlds.maps import MapFolder

    kinds = sorted(report.kinds.items(), key=lambda item: -item[1])
    parts = [f"{number} {kind}" for kind, number in kinds]
    yield "structures", _shortened(parts)
    yield "triangles", str(report.triangles)
    for k, (stage, number) in enumerate(report.stages.items()):
        when = f" ({years[k]})" if years else ""
        yield f"stage {stage}{when}", f"{number} structures"
    if years:
        yield "without a year", str(report.undated)
    for letter, length in zip("ab", report.drives, strict=False):
        yield f"drive {letter}", f"{length:.0f} m"
    if report.faults:
        # What concerns most of the city comes first.
        faults = sorted(
            report.faults, key=lambda one: -report.shares[one.kind].part
        )
        parts = [f"{fault.kind} ({report.told(fault)})" for fault in faults]
        yield "left out or repaired", _shortened(parts)
    yield "written", f"{output}, with all counts in {REPORT_NAME}"
    if not report.drives:
        return
    if len(report.stages) > 1:
        words = ["reproduce", str(output), "--output", "study"]
    else:
        drive = str(
            MapFolder(output).drive(min(report.stages, key=natural_key))
        )
        words = ["simulate", drive, "--output", "recordings"]
    yield "next", shlex.join(["cns-drake", *words])


def _shortened(kinds: Sequence[str]) -> str:
    more = len(kinds) - _SHOWN
    rest = [f"{more} kinds more"] if more > 0 else []
    return "; ".join([*kinds[:_SHOWN], *rest])
