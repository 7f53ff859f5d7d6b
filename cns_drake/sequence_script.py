"""One sequence, run from a diagram script or the command line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from cns_drake import terminal
from cns_drake.cli import (
    Frames,
    Graphviz,
    LidarPreset,
    Output,
    Overwrite,
    Recording,
)
from evaluation.interrupts import uninterrupted

if TYPE_CHECKING:
    from cns_drake.simulation import Run


def run_sequence(
    name_or_file: str,
    output: Path,
    *,
    frames: int | None = None,
    lidar: str | None = None,
    recording: Path | None = None,
    graphviz: Path | None = None,
    overwrite: bool = False,
) -> Run:
    """Runs a sequence on all cores with progress on stderr; see `simulate`.

    Args:
        name_or_file: a shipped sequence or a scenario file.
        output: the folder of recordings.
        frames: record only so many frames.
        lidar: preset that replaces the scenario's LiDARs.
        recording: where to save a web page of the drive.
        graphviz: where to save the Diagram as Graphviz text.
        overwrite: replace an existing recording.

    Raises:
        InputError: something of this cannot be used.
    """
    with uninterrupted():  # Slow to import, not needed for `--help`.
        from cns_drake.scenario import load_scenario
        from cns_drake.simulation import simulate
        from evaluation.cluster import num_cores

    scenario = load_scenario(name_or_file)
    if lidar is not None:
        scenario = scenario.with_lidar_preset(lidar)
    if frames is not None:
        scenario = scenario.model_copy(update={"frames": frames})
    with terminal.show_progress() as progress:
        task = progress.add_task(scenario.name, total=None, note="loading")
        on_frame = terminal.frame_progress(progress, task)
        run = simulate(
            scenario,
            output,
            page_file=recording,
            graphviz_file=graphviz,
            overwrite=overwrite,
            num_threads=num_cores(),
            on_frame=on_frame,
            on_note=lambda text: terminal.print_note(progress, text),
        )
    print(
        f"{run.folder}: {run.num_frames} frames, {run.simulated_s:.2f} s "
        f"simulated in {run.wall_s:.2f} s "
        f"({run.real_time_factor:.1f} times real time)"
    )
    return run


def main(name: str, description: str) -> None:
    """The command line of a diagram script.

    Args:
        name: the sequence.
        description: the script's docstring, shown by `--help`.
    """

    def script(
        output: Output = Path("recordings"),
        frames: Frames = None,
        lidar: LidarPreset = None,
        recording: Recording = None,
        graphviz: Graphviz = None,
        overwrite: Overwrite = False,
    ) -> None:
        run_sequence(
            name,
            output,
            frames=frames,
            lidar=lidar,
            recording=recording,
            graphviz=graphviz,
            overwrite=overwrite,
        )

    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command(help=description)(script)
    terminal.run(app)
