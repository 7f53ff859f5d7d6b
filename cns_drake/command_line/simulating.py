"""The commands `simulate`, `scan` and `generate`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cns_drake.base import (
    InputError,
    doing,
    ended_by_interrupts,
    next_command,
    note,
    shared_options,
    show,
)
from cns_drake.command_line import options
from cns_drake.command_line.experiment_drives import varied_drives
from cns_drake.command_line.fields import changed, field_options

if TYPE_CHECKING:
    from cns_drake.scenarios import Scenario

# Fields of a scenario that a single scan has.
_OF_SCAN = ("lidars", "weather", "seed")
DriveNames = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="NAME",
        help="Names of shipped drives, or scenario files. If you name none, "
        "the drives of the experiment that --vary names are recorded, or all "
        "shipped drives if --vary is not given.",
    ),
]


@field_options(
    "frames", "lidar", "returns", "fog", "rain", "snowfall", "traffic",
    "transient", "driver", "ride", "imu_rate", "camera",
)  # fmt: skip
def simulate(
    scenario: Annotated[str, typer.Argument(metavar="NAME|SCENARIO.yaml")],
    output: options.Output,
    recording: options.Recording = None,
    beside: Annotated[Path | None, typer.Option(metavar="PAGE.html")] = None,
    graphviz: options.Graphviz = None,
    overwrite: options.Overwrite = False,
    json: shared_options.Json = False,
    *,
    changes: dict[str, Any],
) -> None:
    """Simulate a drive and record it.

    Writes a rosbag2 folder, which ROS 2 tools can read. The folder contains a
    file with metadata, and an MCAP file with the scans, the poses and the data
    of all other sensors.

    Args:
        scenario: Name of a shipped drive, as cns-drake list shows it, or a
            scenario file of your own.
        beside: Page that --recording wrote of another drive in the same city,
            such as an earlier stage. The page of this drive then shows both
            drives side by side: when you move in one of them, the other goes to
            the same place.
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.command_line import drive_script

        drive_script.import_simulation()

    if beside is not None and recording is None:
        raise InputError("--beside: needs --recording, the page to write")
    drive_script.run_drive(
        scenario,
        output,
        recording=recording,
        beside=beside,
        graphviz=graphviz,
        overwrite=overwrite,
        json=json,
        **changes,
    )


@field_options("lidar", "returns", "seed", "fog", "rain", "snowfall")
def scan(
    world: Annotated[Path, typer.Argument(metavar="WORLD.sdf")],
    pose: Annotated[
        tuple[float, float, float, float, float, float],
        typer.Option(metavar="X Y Z ROLL PITCH YAW"),
    ],
    output: Annotated[Path, typer.Option()],
    model_path: Annotated[
        list[Path] | None, typer.Option(metavar="DIR")
    ] = None,
    json: shared_options.Json = False,
    *,
    changes: dict[str, Any],
) -> None:
    """Take one LiDAR scan of an SDF world.

    The LiDAR is called lidar, its preset is cns by default, and coordinates are
    not rounded: `--set lidars.lidar.resolution=0.001` rounds them to 1 mm.

    Args:
        world: SDF file of the world to scan.
        pose: Pose of the LiDAR in the world: position, then roll, pitch and yaw
            [m, rad].
        output: File for the scan; its name ends in .pcd, .bin or .npy. An
            existing file is replaced.
        model_path: Folder with the world's model:// files. The command searches
            this folder before the folders in the environment variables
            GZ_SIM_RESOURCE_PATH and SDF_PATH. May be repeated.
    """
    with ended_by_interrupts("cns-drake"):
        import numpy as np
        from pydrake.math import RigidTransform, RollPitchYaw

        from cns_drake.base import check_writable
        from cns_drake.scenarios import make_scenario
        from cns_drake.scene import LARGEST_SIZE, load_world
        from cns_drake.sensors import make_lidar_model
        from cns_drake.simulation import check_ending, save_scan, scan_world

    if not np.isfinite(pose).all():
        raise InputError("--pose: not finite")
    if max(map(abs, pose)) > LARGEST_SIZE:
        raise InputError(f"--pose: {pose} is beyond {LARGEST_SIZE:g} m or rad")
    check_ending(output)
    check_writable(output)
    values = {
        "name": "scan",
        "world": str(world),
        "waypoints": str(world),  # Of a scan: none.
        "speeds": {},
        "lidars": {"lidar": {"resolution": 0.0}},
    }
    plain = make_scenario(values, world)
    scenario = changed(plain, changes)
    _check_fields_of_scan(scenario, plain)
    X_WS = RigidTransform(RollPitchYaw(*pose[3:]), pose[:3])
    doing(f"reading {world.name}")
    loaded = load_world(world, model_paths=model_path or ())
    for text in loaded.notes:
        note(text)
    model = make_lidar_model(
        scenario.lidars["lidar"], "lidar", scenario.seed, scenario.weather
    )
    doing("casting rays")
    points = scan_world(loaded, X_WS, **model._asdict())
    save_scan(points, output)
    show(
        {"output": str(output), "points": len(points)},
        f"{output}: {len(points)} points",
        json=json,
    )


def _check_fields_of_scan(scenario: Scenario, plain: Scenario) -> None:
    """Checks that only fields are changed that a single scan has.

    Args:
        scenario: the changed scenario of the scan.
        plain: the scenario without changes.

    Raises:
        InputError: another field is changed.
    """
    changed_fields = [
        name
        for name, value in scenario
        if name not in _OF_SCAN and value != getattr(plain, name)
    ]
    if list(scenario.lidars) != ["lidar"]:
        changed_fields.append("lidars")
    else:
        lidar, unchanged = scenario.lidars["lidar"], plain.lidars["lidar"]
        changed_fields += [
            f"lidars.lidar.{name}"
            for name in ("xyz", "rpy_deg", "motion_distortion", "layout")
            if getattr(lidar, name) != getattr(unchanged, name)
        ]
    if changed_fields:
        raise InputError(
            f"--set: {changed_fields[0]}: not of a scan, which has one LiDAR, "
            "lidars.lidar, at --pose, and the fields weather and seed"
        )


@field_options("frames")
def generate(
    names: DriveNames = None,
    *,
    output: options.Output,
    jobs: shared_options.Jobs = None,
    scheduler: shared_options.Scheduler = None,
    overwrite: options.Overwrite = False,
    vary: options.Vary = None,
    changes: dict[str, Any],
) -> None:
    """Record many drives.

    Simulates and records the named drives, as many at the same time as --jobs
    says. To resume after an interruption, run the same command again: finished
    recordings are skipped.
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.base import choose_cluster
        from cns_drake.scenarios import load_scenario, recordable_drives
        from cns_drake.studies import record_all

    cluster = choose_cluster(jobs, scheduler)
    if not names and vary is None:
        names = list(recordable_drives())
    scenarios = [load_scenario(name) for name in names or ()]
    if vary is not None:
        varied = varied_drives(vary, output, cluster)
        scenarios += [
            scenario for scenario in varied if scenario not in scenarios
        ]
    scenarios = [changed(scenario, changes) for scenario in scenarios]
    record_all(scenarios, output, cluster, overwrite=overwrite)
    for scenario in scenarios:
        typer.echo(output / scenario.name)
    next_command("cns-eval", "report", output, "--output", "report")
