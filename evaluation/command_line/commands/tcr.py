"""The command `tcr`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from evaluation.base import shared_options, terminal
from evaluation.command_line import options
from evaluation.command_line.printed_text import metric_rows

if TYPE_CHECKING:
    from evaluation.change import ChangeReport

GROUP = "Measure change"


def tcr(
    source: Annotated[Path, typer.Argument(metavar="A")],
    target: Annotated[Path, typer.Argument(metavar="B")],
    no_change: Annotated[Path | None, typer.Option(metavar="C")] = None,
    align: options.Align = "auto",
    lidar: shared_options.Lidars = None,
    odometry: shared_options.Odometry = None,
    poses: shared_options.Poses = None,
    pose_gap: shared_options.PoseGap = None,
    columns: shared_options.ColumnsOfEach = None,
    output: options.Tables = None,
    json: shared_options.Json = False,
) -> None:
    """Measure how much changed between two drives or maps.

    A and B are recorded drives (MCAP, or as a public data set has them) or maps
    (.pcd .ply .npy .bin). TCR_sym is 0 if nothing changed and 1 if everything
    changed. Drives in different world frames are aligned first. A yaw or an
    offset between two frames looks like change, so the command also prints
    TCR_sym after B is registered to A.

    Args:
        source: Drive or map before the change.
        target: Drive or map after the change.
        no_change: Control: a third drive, on A's route in B's stage or on B's
            route in A's stage. TCR_sym between it and the drive in the same
            stage comes from the routes alone.

    Example:
        cns-eval tcr drives/metropolis_01 drives/metropolis_04
    """
    from evaluation.results import make_output
    from evaluation.verbs import change_between

    if output is not None:
        make_output(output)
    found = change_between(
        source,
        target,
        no_change=no_change,
        align=align,
        **shared_options.readings(lidar, odometry, poses, columns, pose_gap),
    )
    report = found.report
    if output is not None:
        options.write_tables(found, output)
    rows = [
        ("first <-> second", f"{report.source} <-> {report.target}"),
        *metric_rows(found, _beside(report)),
    ]
    terminal.show(found.to_json(), rows, json=json)


def _beside(report: ChangeReport) -> dict[str, str]:
    """Returns what stands beside the metrics of `tcr`, by their names."""
    from evaluation.change import COVERAGE_RADIUS

    source, target = report.source, report.target
    found = {
        "tcr_source_to_target": f"{source} -> {target}",
        "tcr_target_to_source": f"{target} -> {source}",
    }
    if report.change.undefined_because:
        found["tcr_sym"] = report.change.undefined_because
    if report.masked is not None and report.masked.undefined_because:
        found["tcr_sym_masked"] = (
            f"no point lies within {COVERAGE_RADIUS:g} m of both routes"
        )
    if report.registered is not None:
        x, y, z = report.registered.offset
        found["tcr_sym_registered"] = f"offset {x:.2f}, {y:.2f}, {z:.2f} m"
    if report.control_names is not None:
        found["tcr_sym_no_change"] = " <-> ".join(report.control_names)
    return found
