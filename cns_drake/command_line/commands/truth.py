"""The command `truth`: exact ground truth about two drives."""

from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from cns_drake.command_line.suggestions import suggest_recognition
from evaluation.base import (
    InputError,
    ended_by_interrupts,
    note,
    shared_options,
    terminal,
)
from evaluation.recognition import RetrievalProtocol

GROUP = "Convert for other programs"


class Format(str, Enum):
    """What the command writes."""

    MAPS = "maps"
    OVERLAPS = "overlaps"


# Distance between two scans of a map, and between two places [m].
_SPACING = {Format.MAPS: 1.0, Format.OVERLAPS: 10.0}


def truth(
    first: Annotated[str, typer.Argument(metavar="A")],
    second: Annotated[str, typer.Argument(metavar="B")],
    output: Annotated[Path, typer.Option()],
    layout: Annotated[Format, typer.Option("--format")] = Format.MAPS,
    spacing: Annotated[
        float | None, typer.Option(min=0.01, metavar="METRES")
    ] = None,
    half_extent: Annotated[
        float | None, typer.Option(min=1.0, max=10_000.0, metavar="METRES")
    ] = None,
    json: shared_options.Json = False,
) -> None:
    """Write exact ground truth about two drives through one city.

    The format maps is the ground truth for change detection: maps of two drives
    with an exact label for each point, which cns-eval map-update compares with
    those of a change detector. The older map has the labels kept, gone and
    unobserved, the newer one kept, new and newly seen.

    The format overlaps has the exact overlap of each query of drive B with each
    place of drive A, for cns-eval pr --exact-overlaps.

    Args:
        first: Older drive, or database drive: a shipped drive or a scenario
            file or, with maps, a recording of cns-drake.
        second: Newer drive, or query drive, in the same way.
        output: Folder to write: new, empty, or, with overlaps, with earlier
            overlaps.
        layout: What to write.
        spacing: Distance that the car drives between two scans of a map (by
            default 1), or between two places (by default 10) [m].
        half_extent: Largest absolute x, y and z of a point of which overlaps
            are computed, in the LiDAR's frame [m]. By default 100. Only with
            --format overlaps.

    Example:
        cns-drake truth metropolis_01 metropolis_04 \\
            --output maps
    """
    spacing = spacing or _SPACING[layout]
    if layout == Format.OVERLAPS:
        protocol = RetrievalProtocol(
            query_spacing=spacing, half_extent=half_extent or 100.0
        )
        _write_overlaps((first, second), output, protocol, json=json)
    elif half_extent is not None:
        raise InputError("--half-extent: only with --format overlaps")
    else:
        _write_maps(first, second, output, spacing, json=json)


def _write_overlaps(
    words: Sequence[str],
    output: Path,
    protocol: RetrievalProtocol,
    *,
    json: bool,
) -> None:
    """Writes the overlaps between a database and a query drive."""
    with ended_by_interrupts("cns-drake"):
        from cns_drake.ground_truth import write_overlap_table
        from cns_drake.scenarios import load_scenario

    drives = [load_scenario(word) for word in words]
    table = write_overlap_table(drives[0], drives[1], output, protocol)
    terminal.show({"output": [str(table)]}, str(table), json=json)
    suggest_recognition(drives, words, table, protocol)


def _write_maps(
    a: str, b: str, output: Path, spacing: float, *, json: bool
) -> None:
    """Writes maps of two drives with exact labels of what changed.

    Args:
        a: older drive.
        b: newer drive.
        output: folder to write.
        spacing: distance between two scans of a map [m].
        json: whether to print the counts of labels as JSON.
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.ground_truth import write_truth

    result: dict[str, Any] = {"output": str(output)}
    for side, found in write_truth(a, b, output, spacing).items():
        result[side] = found.points
        text = ", ".join(
            f"{number} {name.replace('_', ' ')}"
            for name, number in found.points.items()
        )
        note(f"{side}: {text}")
        number, mapped, changed = found.alone()
        note(
            f"{side}: {number} structures are in this drive's world alone;"
            f" {mapped} are in its map, {changed} of them gone or new"
        )
    terminal.show(result, str(output), json=json)
    terminal.next_command("cns-eval", "map-update", output)
