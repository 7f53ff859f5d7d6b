"""Commands on maps: `list`, `import`, `city` and `age`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
import shlex
import shutil
import sys
from typing import TYPE_CHECKING, Annotated

import typer

from cns_drake.base import commands
from cns_drake.base.errors import InputError, did_you_mean
from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.listing import natural_key
from cns_drake.base.number_text import whole_number
from cns_drake.base.terminal import next_command, note, show
from cns_drake.imports.options import (
    REPORT_NAME,
    DriveOn,
    ImportOptions,
    ImportReport,
    Undated,
)

if TYPE_CHECKING:
    from cns_drake.scenarios.drive_table import DriveRow

_HEADINGS = (
    "drive",
    "map",
    "stage",
    "length",
    "time",
    "frames",
    "structures",
    "triangles",
)
# Columns without room are dropped in this order.
_GIVE_WAY = (
    "map",
    "structures",
    "triangles",
    "stage",
    "frames",
    "time",
    "length",
)
_GAP = "  "
# Share of the buildings that the first stage of a city without years lacks.
_GROW = 0.3
# Kinds of structures and of faults that a report names.
_SHOWN = 5

FirstYear = Annotated[
    list[int],
    typer.Option(
        "--years",
        metavar="YEAR ...",
        help="Years for which to make stages, counted from today, in ascending "
        "order and at most 200. Negative years lie in the past; they need a "
        "map whose buildings have years of construction.",
    ),
]

RateFactor = Annotated[
    float,
    typer.Option(
        min=0.0,
        metavar="FACTOR",
        help="Factor by which all yearly rates are multiplied. With 2, the "
        "city changes twice as fast.",
    ),
]
RatesFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.yaml",
        help="File with your own rates. Each line has the form event: rate, "
        "where the rate is the probability per year, from 0 to 1. All other "
        "events have their default rates.",
    ),
]


def list_drives(
    folders: Annotated[
        list[Path] | None, typer.Argument(metavar="FOLDER")
    ] = None,
    json: commands.Json = False,
) -> None:
    """List drives with their lengths, times and sizes.

    The columns are the length and duration of each drive, its number of frames,
    and the numbers of structures and triangles in its stage. A narrow terminal
    shows fewer columns. A file or pipe gets all columns.

    Args:
        folders: Folders of your own maps, whose drives are listed; by default
            the drives of the shipped maps.
    """
    with uninterrupted():
        from cns_drake.scenarios.drive_table import drive_rows
        from cns_drake.scenarios.shipped import shipped_maps

    rows = []
    for folder in folders or shipped_maps().values():
        of_map = drive_rows(folder)
        if folders and not of_map:
            raise InputError(
                f"{folder}: no sequence_NN.yaml whose stage_NN.sdf is there"
            )
        rows += of_map
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    show(
        {"drives": [asdict(one) for one in rows]},
        "\n".join(table_lines(rows, width)),
        json=json,
    )


def table_lines(rows: list[DriveRow], width: int | None) -> Iterator[str]:
    """Yields the lines of a table of drives.

    Args:
        width: greatest number of characters of a line. Columns that do not fit
            are dropped, except the names. None keeps all columns.
    """
    lines = [_HEADINGS] + [
        (
            row.sequence,
            row.map,
            row.stage,
            f"{row.length:.0f} m",
            f"{row.duration:.1f} s",
            str(row.frames),
            str(row.structures),
            str(row.triangles),
        )
        for row in rows
    ]
    columns = dict(zip(_HEADINGS, zip(*lines, strict=True), strict=True))
    widths = {name: max(map(len, cells)) for name, cells in columns.items()}
    for name in _GIVE_WAY:
        total = sum(widths.values()) + len(_GAP) * (len(widths) - 1)
        if width is None or total <= width:
            break
        del widths[name]
    for line in lines:
        cells = dict(zip(_HEADINGS, line, strict=True))
        yield _GAP.join(
            cells[name].ljust(widths[name])
            if name in ("drive", "map", "stage")
            else cells[name].rjust(widths[name])
            for name in widths
        ).rstrip()


def import_city(
    source: Annotated[list[str], typer.Argument(metavar="FILE")],
    output: Annotated[Path, typer.Option()],
    years: Annotated[list[int] | None, typer.Option(metavar="YEAR ...")] = None,
    year_attribute: Annotated[str | None, typer.Option(metavar="NAME")] = None,
    undated: Undated = "first",
    lod: float | None = None,
    seed: Annotated[int, typer.Option(min=0)] = 0,
    along: Annotated[Path | None, typer.Option(metavar="WAYPOINTS")] = None,
    within: Annotated[
        float | None, typer.Option(min=1.0, metavar="METRES")
    ] = None,
    drive_on: DriveOn | None = None,
    grow: Annotated[
        float | None, typer.Option(min=0.01, max=0.9, metavar="PART")
    ] = None,
    plain: Annotated[bool, typer.Option("--plain")] = False,
    json: commands.Json = False,
) -> None:
    """Make a map from data of a real city.

    Writes the stages of the map, two drives along its streets and a picture of
    the map from above.

    Args:
        source: File of the city: CityJSON 1.0 to 2.0 (.json), CityJSONSeq
            (.jsonl), OpenStreetMap (.osm, .pbf) or OpenDRIVE (.xodr).
        output: Folder of the map to write; its name becomes the map's name.
        years: Years for which to make stages. Each stage contains the buildings
            that were built by its year.
        year_attribute: Name of the attribute in the file that contains each
            building's year of construction. By default the command tries the
            usual names.
        undated: Stages that contain the buildings without a year of
            construction: all stages (first), only the last stage (last), or no
            stage (never).
        lod: Level of detail (LoD) at which buildings are read from CityJSON,
            such as 1.2; by default the highest level that each building has.
        seed: Seed of all random choices: which buildings change between the
            first stage and today (--grow), and which details are added to
            buildings and streets. For an OpenDRIVE file, which has no
            buildings, the whole city depends on the seed.
        along: CSV file with the path of a drive of your own: columns x and y in
            the frame of the map [m]. This drive replaces the two drives that
            the command otherwise makes.
        within: Greatest distance of structures from the drives [m]. Structures
            beyond this distance are left out, to save memory. By default, no
            structure is left out.
        drive_on: Side of the street on which cars drive; by default the side
            that the file names, or right if the file names none.
        grow: Share of the buildings that change between an added first stage
            and today, from 0.01 to 0.9; by default 0.3. In the first stage,
            these buildings, sampled at random, are missing or lower than today.
            For an OpenDRIVE file, the buildings in the east are missing
            instead, and the default is 0.35. Not with --years or --plain, which
            add no such stage.
        plain: Do not add windows, lamps, parked cars and other details that the
            file does not contain. Only OpenDRIVE files, which contain no
            buildings, still get buildings along their roads.
    """
    # The years that follow the first of --years come as arguments.
    paths = [word for word in source if not word.isdecimal()]
    more = [
        whole_number(word, "--years") for word in source if word.isdecimal()
    ]
    if len(paths) != 1 or (more and not years):
        raise InputError(f"give one file, not {' '.join(source)}")
    path = Path(paths[0])
    stages = tuple(sorted([*(years or ()), *more]))
    if plain and grow is not None:
        raise InputError(
            "--grow: not with --plain, which adds nothing at random"
        )
    if not plain and not stages and path.suffix != ".xodr" and grow is None:
        grow = _GROW
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
    with uninterrupted():
        from cns_drake.imports import import_map
        from cns_drake.scenarios.drive_table import write_table

    report = import_map.import_city(
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
        "faults": {kind: count for kind, count, _ in report.faults},
    }
    show(values, _report_rows(report, output, options.years), json=json)


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
            f"{report.dated} of {report.dated + report.undated} buildings have"
            f" a year, and the stages {numbers} structures; in place of"
            " --years, --grow samples a change at random"
        )


def _report_rows(
    report: ImportReport, output: Path, years: tuple[int, ...]
) -> Iterator[tuple[str, str]]:
    """Yields lines with the most important numbers, and the next command."""
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
        parts = [f"{kind} ({number})" for kind, number, _ in report.faults]
        yield "left out or repaired", _shortened(parts)
    yield "written", f"{output}, with all counts in {REPORT_NAME}"
    if not report.drives:
        return
    if len(report.stages) > 1:
        words = ["reproduce", str(output), "--output", "study"]
    else:
        drive = str(
            output / f"sequence_{min(report.stages, key=natural_key)}.yaml"
        )
        words = ["simulate", drive, "--output", "recordings"]
    yield "next", shlex.join(["cns-drake", *words])


def _shortened(kinds: Sequence[str]) -> str:
    more = len(kinds) - _SHOWN
    rest = [f"{more} kinds more"] if more > 0 else []
    return "; ".join([*kinds[:_SHOWN], *rest])


@commands.former_options({"--start": "--new"})
def city(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER")],
    new: Annotated[bool, typer.Option("--new")] = False,
    seed: Annotated[int | None, typer.Option(min=0, metavar="N")] = None,
    check: Annotated[bool, typer.Option("--check")] = False,
    repair_stages: Annotated[bool, typer.Option("--repair-stages")] = False,
) -> None:
    """Build the stages of a city from its roads and plan.

    You write the files roads.yaml, with the roads, and city.yaml, with the
    districts along the roads. The command generates an SDF world for each
    stage.

    Args:
        folder: Folder with roads.yaml, city.yaml and stages.yaml. The command
            writes the stages to this folder, and updates the folder's table of
            drives.
        new: Start from a folder with only roads.yaml: first write the missing
            files, which are a city.yaml with a district for each block, two
            stages, and a drive for each stage. Existing files are not changed.
        seed: Seed of the random districts and drives that --new writes; by
            default 0.
        check: Write nothing. List the files that would change, and exit with
            status 1 if any would.
        repair_stages: Update the names of structures in stages.yaml. Use this
            option after additions to city.yaml, which renumber the structures.
            The command recognises structures by their coordinates in the
            structures.csv of the last run.
    """
    with uninterrupted():
        from cns_drake.city.generation.generate import (
            differing_files,
            generate_city,
        )
        from cns_drake.city.generation.starter import start_city
        from cns_drake.scenarios.drive_table import write_table

    if seed is not None and not new:
        raise InputError("--seed: has no effect without --new")
    if new and check:
        raise InputError(
            "--new and --check exclude each other; give one of them"
        )
    if check:
        changed = differing_files(folder, note, repair_stages=repair_stages)
        for path in changed:
            print(path)
        if changed:
            raise typer.Exit(1)
        return
    if new:
        start_city(folder, seed or 0, note)
    files = generate_city(folder, note, repair_stages=repair_stages)
    write_table(folder)
    note(f"{len(files)} files")
    _name_next(folder)


def maps_and_years(
    words: list[str], first: list[int]
) -> tuple[list[str], tuple[int, ...]]:
    """Separates the maps from the years in a command such as `a b --years 5 9`.

    The parser takes only the first year after --years as the option's value.
    The parser appends all further years to the arguments, after the names of
    the maps.

    Args:
        words: the arguments of the command: names of maps, then the further
            years.
        first: the values that the parser has already read for --years, one per
            occurrence of the option.

    Returns:
        The names of the maps, and all years.

    Raises:
        InputError: a word begins like an option.
    """
    maps = []
    years = list(first)
    for word in words:
        if word.removeprefix("-").isdecimal():
            years.append(whole_number(word, "--years"))
        elif word.startswith("-"):
            raise InputError(f"{word}: no such option")
        else:
            maps.append(word)
    return maps, tuple(years)


def age(
    source: Annotated[list[str], typer.Argument(metavar="MAP")],
    output: Annotated[Path, typer.Option()],
    years: FirstYear,
    seed: Annotated[int, typer.Option(min=0)] = 0,
    rate: RateFactor = 1.0,
    rates: RatesFile = None,
    pictures: Annotated[bool, typer.Option("--pictures/--no-pictures")] = True,
    json: commands.Json = False,
) -> None:
    """Simulate years of change in a city.

    Every year, each lot, tree and street object may change, with a given
    probability: buildings are built, torn down and replaced, trees die, lamps
    and signs move. Writes a map with a stage for today and a stage for each
    given year, a table of all events, the observed rates, and pictures.

    Args:
        source: Name of a shipped map, or folder of a map.
        output: Folder of the map to write; its name becomes the map's name.
        seed: Seed of all random events. Another seed gives another realisation
            of the city's ageing.
        pictures: Draw pictures of the city from the air and of three streets.
    """
    maps, wanted = maps_and_years(source, years)
    if len(maps) != 1:
        raise InputError(f"give one map, not {' '.join(maps) or 'none'}")
    with uninterrupted():
        from cns_drake.ageing.aged_map import age_map
        from cns_drake.ageing.aged_pictures import draw_pictures
        from cns_drake.ageing.rates import read_rates
        from cns_drake.scenarios.shipped import shipped_maps

    folder = shipped_maps().get(maps[0], Path(maps[0]))
    if not folder.is_dir():
        raise InputError(
            f"{maps[0]}: neither a shipped map ({', '.join(shipped_maps())}) "
            f"nor a folder{did_you_mean(maps[0], shipped_maps())}"
        )
    aged = age_map(
        folder,
        wanted,
        seed,
        read_rates(rates, rate),
        output,
        finish=lambda draft, one: (
            draw_pictures(draft, one) if pictures else None
        ),
    )
    rows = [
        (f"stage {stage}", f"year {year}" if year else "today")
        for stage, year in aged.years.items()
    ]
    rows += [(event, str(number)) for event, number in aged.events.items()]
    values = {
        "output": str(output),
        "years": dict(aged.years),
        "events": dict(aged.events),
    }
    show(values, [*rows, ("written", str(output))], json=json)
    _name_next(output)


def _name_next(folder: Path) -> None:
    words = ("reproduce", folder, "--output", "study", "--no-recordings")
    next_command("cns-drake", *words)
