"""One drive, run from a diagram script or the command line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import sys
from typing import TYPE_CHECKING, Any

from cns_drake.command_line import options
from cns_drake.command_line.fields import changed, field_options
from cns_drake.command_line.suggestions import suggest_export
from evaluation.base import (
    InputError,
    example,
    program,
    show_progress,
    terminal,
    uninterrupted,
)

if TYPE_CHECKING:
    from cns_drake.simulation import FinishedSimulation


def import_simulation() -> Callable[..., FinishedSimulation]:
    """Imports the simulation, which is slow and not needed for `--help`."""
    from cns_drake.simulation import simulate

    return simulate


def run_drive(
    name_or_file: str,
    output: Path | str,
    *,
    recording: Path | str | None = None,
    beside: Path | str | None = None,
    graphviz: Path | str | None = None,
    overwrite: bool = False,
    json: bool = False,
    **changes: Any,
) -> FinishedSimulation:
    """Simulates and records a drive, and shows on stderr what it does.

    All cores are used. `simulate` does the same for a scenario that is already
    loaded, and shows nothing.

    Args:
        name_or_file: name of a shipped drive, or a scenario file.
        output: folder for the recordings.
        recording: file for a web page of the drive, if any.
        beside: page of another drive in the same city, which the page of this
            drive then shows as well.
        graphviz: file for the Diagram as Graphviz text, if any.
        overwrite: whether to replace an existing recording.
        json: whether to print the result as JSON.
        changes: what the options of `cns-drake simulate` for fields of the
            scenario change, such as `frames=200`, `lidar="vlp-16"` or
            `imu_rate=400`; `fields` are texts `FIELD=VALUE` as for `--set`,
            `transient` and `camera` can be mappings, and `weather` is a
            `WeatherConfig`.

    Raises:
        InputError: an argument cannot be used.

    Example:
        from cns_drake import run_drive

        run_drive("downtown_01", "recordings", frames=20)
    """
    from cns_drake.scenarios import load_scenario
    from evaluation.base import num_cores

    with uninterrupted():
        simulate = import_simulation()
    if recording is not None and Path(recording).suffix != ".html":
        raise InputError(f"--recording: {recording} does not end in .html")
    scenario = changed(load_scenario(name_or_file), changes)
    with show_progress():
        run = simulate(
            scenario,
            output,
            page_file=recording,
            beside=beside,
            graphviz_file=graphviz,
            overwrite=overwrite,
            num_threads=num_cores(),
            on_note=terminal.note,
        )
    values = {
        "output": str(run.folder),
        "frames": run.num_frames,
        "simulated_seconds": run.simulated_s,
        "wall_seconds": run.wall_s,
    }
    terminal.show(
        values,
        f"{run.folder}: {run.num_frames} frames, {run.simulated_s:.2f} s "
        f"simulated in {run.wall_s:.2f} s "
        f"({run.real_time_factor:.1f} times real time)",
        json=json,
    )
    for file in (recording, graphviz):
        if file is not None:
            terminal.note(f"wrote {file}")
    if recording is not None:
        terminal.next_page(recording)
    else:
        suggest_export(run.folder, scenario)
    return run


def run_script(name: str, description: str) -> None:
    """Runs the command line of a diagram script: records one drive.

    Args:
        name: name of the drive.
        description: the script's docstring, shown by `--help`.

    Example:
        from cns_drake import run_script

        run_script("downtown_01", "Downtown before it was built up.")
    """

    @field_options("frames", "lidar", "traffic")
    def script(
        output: options.Output = Path("recordings"),
        recording: options.Recording = None,
        graphviz: options.Graphviz = None,
        overwrite: options.Overwrite = False,
        *,
        changes: dict[str, Any],
    ) -> None:
        run_drive(
            name,
            output,
            recording=recording,
            graphviz=graphviz,
            overwrite=overwrite,
            **changes,
        )

    app = program.plain_app(add_completion=False)
    epilog = example(f"python diagrams/{name}.py --frames 200")
    app.command(
        help=description,
        epilog=epilog,
        context_settings=program.WIDE_HELP,
    )(script)
    program.run(app, Path(sys.argv[0]).name, show_progress())
