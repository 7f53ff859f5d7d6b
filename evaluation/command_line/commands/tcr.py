"""The command `tcr`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cns_drake.base import number_text, shared_options, terminal
from evaluation.command_line import options

if TYPE_CHECKING:
    from evaluation.change import ChangeReport

GROUP = "Measure change"


def tcr(
    source: Annotated[Path, typer.Argument(metavar="A")],
    target: Annotated[Path, typer.Argument(metavar="B")],
    no_change: Annotated[Path | None, typer.Option(metavar="C")] = None,
    align: options.Align = "auto",
    lidar: shared_options.LidarName = None,
    columns: shared_options.Columns = None,
    output: options.Tables = None,
    json: shared_options.Json = False,
) -> None:
    """Measure how much changed between two drives or maps.

    A and B are recorded drives (MCAP, or as a public data set has them) or maps
    (.pcd .ply .npy .bin). The main result, TCR_sym, is 0 if nothing changed and
    1 if everything changed. The command also prints two directed ratios: the
    share of A that is missing in B, and the share of B that is missing in A.
    Drives in different world frames are aligned first. A yaw or an offset
    between two frames looks like change, so the command also registers B to A,
    and prints TCR_sym after this registration.

    Args:
        source: Drive or map before the change.
        target: Drive or map after the change.
        no_change: Control: a third drive, on A's route in B's stage or on B's
            route in A's stage. With it, the command also prints TCR_sym between
            C and the drive in the same stage. These two drives differ only in
            their routes.

    Example:
        cns-eval tcr drives/metropolis_01 drives/metropolis_04
    """
    from evaluation.change import (
        maps_in_one_world,
        registered_change,
        same_stage_partner,
        spread_over_grids,
    )
    from evaluation.drives import NOT_FINITE
    from evaluation.results import LAST, OWN, STAGE, make_output
    from evaluation.study import ChangeTask, measure_pairs, pair_of_drive_maps

    named = [path for path in (source, target, no_change) if path is not None]
    maps, alignments = maps_in_one_world(named, align, lidar, columns)
    before, after, *controls = maps
    compared = [(before, after)] + [
        (third, same_stage_partner(before, after, third)) for third in controls
    ]
    pairs = [
        pair_of_drive_maps(
            both,
            (before.name, after.name),
            factors={STAGE: stage} if controls else {},
            key=stage,
        )
        for both, stage in zip(compared, (OWN, LAST), strict=False)
    ]
    if output is not None:
        make_output(output)
    engine = measure_pairs("tcr", pairs, [ChangeTask({}, "tcr")], output)
    report, *beside = (engine.found(pair, ChangeTask.name) for pair in pairs)
    for other in beside:
        report = report.beside(other)
    report = replace(
        report,
        spread=spread_over_grids(before, after, report.change),
        alignment=alignments[0] if alignments else None,
        registered=registered_change(before, after),
    )
    for drive_map in maps:
        for note in drive_map.notes:
            terminal.note(note)
        ignored = drive_map.voxels.num_ignored
        if ignored:
            terminal.note(f"{drive_map.name}: {ignored} {NOT_FINITE}")
    for alignment in alignments:
        terminal.note(alignment.to_text())
    if report.note is not None:
        terminal.note(report.note)
    if output is not None:
        options.write_tables(engine)
    terminal.show(report.to_json(), _change_rows(report), json=json)


def _change_rows(report: ChangeReport) -> Iterator[tuple[str, str]]:
    """Yields names and values of the results of `tcr`."""
    from evaluation.change import COVERAGE_RADIUS

    change = report.change
    source, target = report.source, report.target
    yield "pair", f"{source} <-> {target}"
    yield "TCR_sym", number_text(change.symmetric)
    yield "  on shifted grids", " to ".join(map(number_text, report.spread))
    if change.undefined_because:
        yield "  because", change.undefined_because
    if (registered := report.registered) is not None:
        x, y, z = registered.offset
        yield (
            "  after registration",
            f"{number_text(registered.symmetric)}"
            f"  (yaw {registered.yaw_deg:.2f} deg,"
            f" offset {x:.2f}, {y:.2f}, {z:.2f} m)",
        )
    for names, side in (
        (f"{source} -> {target}", change.source_to_target),
        (f"{target} -> {source}", change.target_to_source),
    ):
        counts = f"({side.num_unchanged} of {side.num_in_hull} unchanged)"
        yield f"TCR {names}", f"{number_text(side.ratio)}  {counts}"
    if report.masked is not None:
        value = number_text(report.masked.symmetric)
        if report.masked.undefined_because:
            value += (
                f"  (no point lies within {COVERAGE_RADIUS:g} m of both routes)"
            )
        yield "TCR_sym where both drove", value
    if report.control is not None and report.control_names is not None:
        names = " <-> ".join(report.control_names)
        value = number_text(report.control.symmetric)
        yield "TCR_sym of only the routes", f"{value}  ({names})"
