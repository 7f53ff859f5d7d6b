"""The command `cns-drake`.

Everything slow to import is imported by the command that needs it, so that
`--help` and `list` answer at once; interrupts wait meanwhile.
"""

from __future__ import annotations

from enum import Enum
from pathlib import Path
import sys
from typing import Annotated

import typer

from cns_drake import terminal
from cns_drake.errors import InputError
from evaluation.interrupts import uninterrupted

app = typer.Typer(
    help="Cities that change, driven and recorded by simulated LiDAR.",
    add_completion=False,
    pretty_exceptions_enable=False,
)

Output = Annotated[
    Path, typer.Option(help="Folder for recordings; created if need be.")
]
Frames = Annotated[
    int | None,
    typer.Option(min=1, help="Record only the first N frames (20 a second)."),
]
LidarPreset = Annotated[
    str | None,
    typer.Option(
        help="Replace the LiDAR: cns, os1-32, os1-64, os1-128, vlp-16, hdl-64e."
    ),
]
Recording = Annotated[
    Path | None,
    typer.Option(help="Also save a web page of the drive, FILE.html."),
]
Graphviz = Annotated[
    Path | None,
    typer.Option(help="Also save the Diagram as Graphviz text."),
]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace an existing recording.")
]
Jobs = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        help="Work on this machine, on N jobs side by side; as many as it has "
        "cores by default.",
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Work on the cluster of this Dask scheduler; by default that of "
        "DASK_SCHEDULER_ADDRESS, if that is set.",
    ),
]


class ExportFormat(str, Enum):
    """Layouts to which sequences are exported."""

    CNS = "cns"
    KITTI = "kitti"


@app.command("list")
def list_sequences(
    folders: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[FOLDER]...",
            help="Folders of maps of your own; the shipped ones if none.",
        ),
    ] = None,
) -> None:
    """List sequences: length, duration, frames; the size of their stage."""
    with uninterrupted():
        from rich.console import Console
        from rich.table import Table

        from cns_drake.paths import shipped_maps
        from cns_drake.sequence_table import sequence_rows

    # Without a frame the table fits into 80 columns.
    table = Table("sequence", "map", "stage", box=None, padding=(0, 1, 0, 0))
    for heading in ("length", "duration", "frames", "structures", "triangles"):
        table.add_column(heading, justify="right", no_wrap=True)
    for folder in folders or shipped_maps().values():
        rows = sequence_rows(folder, lambda line: print(line, file=sys.stderr))
        if folders and not rows:
            raise InputError(
                f"{folder}: no sequence_NN.yaml whose stage_NN.sdf is there"
            )
        for row in rows:
            table.add_row(
                row.sequence,
                row.map,
                row.stage,
                f"{row.length:.0f} m",
                f"{row.duration:.1f} s",
                str(row.frames),
                str(row.structures),
                str(row.triangles),
            )
    Console().print(table)


@app.command()
def simulate(
    scenario: Annotated[
        str,
        typer.Argument(
            metavar="NAME|SCENARIO.yaml",
            help="A shipped sequence, or a scenario file of your own.",
        ),
    ],
    output: Output,
    frames: Frames = None,
    lidar: LidarPreset = None,
    recording: Recording = None,
    graphviz: Graphviz = None,
    overwrite: Overwrite = False,
) -> None:
    """Drive a sequence and record it as a rosbag2 folder of MCAP."""
    with uninterrupted():
        from cns_drake.sequence_script import run_sequence

    run_sequence(
        scenario,
        output,
        frames=frames,
        lidar=lidar,
        recording=recording,
        graphviz=graphviz,
        overwrite=overwrite,
    )


@app.command()
def scan(
    world: Annotated[
        Path, typer.Argument(metavar="WORLD.sdf", help="Any SDF world.")
    ],
    pose: Annotated[
        tuple[float, float, float, float, float, float],
        typer.Option(
            metavar="X Y Z ROLL PITCH YAW",
            help="The sensor's pose in the world [m, rad].",
        ),
    ],
    output: Annotated[
        Path, typer.Option(help="Where to save: .pcd, .bin or .npy.")
    ],
    lidar: LidarPreset = "cns",
) -> None:
    """Take one scan of any SDF world."""
    with uninterrupted():
        import numpy as np
        from pydrake.math import RigidTransform, RollPitchYaw

        from cns_drake.scanning import check_ending, save_scan, scan_world
        from cns_drake.scenario import make_lidar_config
        from cns_drake.world import load_world

    if not np.isfinite(pose).all():
        raise InputError("--pose: not finite")
    check_ending(output)
    pattern = make_lidar_config(lidar).pattern()
    X_WS = RigidTransform(RollPitchYaw(*pose[3:]), pose[:3])
    points = scan_world(load_world(world), X_WS, pattern)
    save_scan(points, output)
    typer.echo(f"{output}: {len(points)} points")


@app.command()
def export(
    sequence: Annotated[
        Path,
        typer.Argument(
            metavar="SEQUENCE", help="A recorded folder, or its .mcap file."
        ),
    ],
    layout: Annotated[
        ExportFormat,
        typer.Option(
            "--format", help="Layout of the CNS data set, or KITTI odometry."
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            help="Folder of drives: new, empty, or of earlier exports."
        ),
    ],
    sensor: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Which LiDAR, if there are several."),
    ] = None,
) -> None:
    """Export a recorded sequence to a layout that exists already."""
    with uninterrupted():
        from cns_drake.export.exporting import export_sequence

    with terminal.show_progress() as progress:
        task = progress.add_task(sequence.name, total=None, note="reading")
        drive = export_sequence(
            sequence,
            layout.value,
            output,
            lidar=sensor,
            on_frame=terminal.count_progress(progress, task),
        )
    typer.echo(drive)


@app.command()
def generate(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...",
            help="Shipped sequences or scenario files; all shipped ones by "
            "default.",
        ),
    ] = None,
    *,
    output: Output,
    frames: Frames = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    overwrite: Overwrite = False,
    vary: Annotated[
        Path | None,
        typer.Option(
            metavar="FAMILY.yaml",
            help="Record the members of a family, whose scenario files go to "
            "<output>/scenarios and whose own cities to <output>/cities, and "
            "whatever is named.",
        ),
    ] = None,
) -> None:
    """Record many sequences; skip finished ones, resume interrupted ones."""
    with uninterrupted():
        from cns_drake.jobs import record_all
        from cns_drake.paths import recordable_sequences
        from cns_drake.scenario import load_scenario
        from evaluation.cluster import choose_cluster

    cluster = choose_cluster(jobs, scheduler)
    if not names and vary is None:
        names = list(recordable_sequences())
    scenarios = [load_scenario(name) for name in names or ()]
    if vary is not None:
        from cns_drake.redrawing import redraw_cities
        from cns_drake.variation import load_family, write_scenarios

        def redraw(*city) -> dict[int, Path]:
            return redraw_cities(*city, output / "cities", cluster)

        members = load_family(vary, redraw)
        write_scenarios(members, output / "scenarios")
        scenarios += members
    if frames is not None:
        scenarios = [s.model_copy(update={"frames": frames}) for s in scenarios]
    record_all(scenarios, output, cluster, overwrite=overwrite)
    for scenario in scenarios:
        typer.echo(output / scenario.name)


@app.command()
def repair(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="Any MCAP file, or what is left of one."
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(help="The new file; <name>_repaired.mcap by default."),
    ] = None,
) -> None:
    """Make a whole MCAP file of what is readable of a damaged one."""
    with uninterrupted():
        from cns_drake.repair import repair_mcap

    with terminal.show_progress() as progress:
        task = progress.add_task(file.name, total=None, note="")
        result = repair_mcap(
            file,
            output,
            terminal.count_progress(progress, task, unit="bytes"),
        )
    typer.echo(
        f"{result.output}: {result.num_messages} messages over "
        f"{result.seconds:.2f} s recovered; "
        + (
            f"damaged places: {result.num_faults}, the first at "
            f"{result.first_fault}"
            if result.num_faults
            else "the file was whole"
        )
    )


@app.command()
def reproduce(
    maps: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[MAP]...",
            help="Which maps, by name or folder; all shipped ones by default.",
        ),
    ] = None,
    *,
    output: Output,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    pages: Annotated[
        bool | None,
        typer.Option(
            "--pages/--no-pages",
            help="Also make a web page of each drive; by default, unless "
            "--quick is given.",
        ),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="The report alone: simulate without recording, and leave out "
            "same-stage controls.",
        ),
    ] = False,
) -> None:
    """Simulate a map's sequences, evaluate them and report."""
    with uninterrupted():
        from cns_drake.reproduction import reproduce_maps
        from evaluation.cluster import choose_cluster

    cluster = choose_cluster(jobs, scheduler)
    if quick and pages:
        raise InputError("--quick and --pages: give one of them")
    report = reproduce_maps(
        maps, output, cluster, with_pages=pages is not False, quick=quick
    )
    typer.echo(report)


def main() -> None:
    """Runs the command line."""
    if not sys.argv[1:]:
        sys.argv.append("--help")
    terminal.run(app)


if __name__ == "__main__":
    main()
