"""Commands that simulate, and those on recordings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
import re
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cns_drake.base import commands
from cns_drake.base.errors import InputError
from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.progress_bars import count_progress, show_progress
from cns_drake.base.terminal import next_command, note
from cns_drake.command_line import options

if TYPE_CHECKING:
    from cns_drake.base.jobs.cluster import Cluster
    from cns_drake.scenarios.scenario import Scenario
    from cns_drake.sensors.lidar.config import WeatherConfig

Kind = Literal["ideal", "calibrated"]
Returns = Annotated[
    Kind | None,
    typer.Option(
        help="Ideal returns, or those of the unit's data sheet with noise, "
        "losses and calibrated reflectivity as intensity."
    ),
]
DriveNames = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="NAME",
        help="Shipped drives or scenario files; all shipped ones by default.",
    ),
]
Fog = Annotated[
    float | None,
    typer.Option(
        metavar="METRES",
        help="Visibility in fog. Weather switches calibrated returns on.",
    ),
]
Rain = Annotated[float, typer.Option(metavar="MM_H", help="Rate of rain.")]
Snowfall = Annotated[
    float, typer.Option(metavar="MM_H", help="Rate of snowfall, as water.")
]


def family_members(
    vary: Path, output: Path, cluster: Cluster
) -> list[Scenario]:
    """Returns the members of a family.

    Their scenario files go to `<output>/scenarios`, cities of their own to
    `<output>/cities`.

    Raises:
        InputError: the family cannot be used.
    """
    from cns_drake.scenarios.variation import load_family, write_scenarios
    from cns_drake.studies.redrawing import redraw_cities

    def redraw(
        map_folder: Path, stage: str, seeds: Sequence[int]
    ) -> dict[int, Path]:
        return redraw_cities(
            map_folder, stage, seeds, output / "cities", cluster
        )

    members = load_family(vary, redraw)
    write_scenarios(members, output / "scenarios")
    return members


def choose_returns(
    returns: Kind | None, fog: float | None, rain: float, snowfall: float
) -> tuple[Kind | None, WeatherConfig | None]:
    """Returns the returns and the weather of the options; None if not given.

    Raises:
        InputError: a value is out of range; the message names its option.
    """
    if fog is None and not rain and not snowfall:
        return returns, None
    from pydantic import ValidationError

    from cns_drake.sensors.lidar.config import WeatherConfig

    if returns == "ideal":
        raise InputError("--returns ideal: weather needs calibrated returns")
    try:
        weather = WeatherConfig(visibility=fog, rain=rain, snowfall=snowfall)
    except ValidationError as error:
        fault = error.errors()[0]
        field = str(fault["loc"][0])
        option = "fog" if field == "visibility" else field
        raise InputError(f"--{option}: {fault['msg']}") from None
    return "calibrated", weather


def simulate(
    scenario: Annotated[str, typer.Argument(metavar="NAME|SCENARIO.yaml")],
    output: options.Output,
    frames: options.Frames = None,
    lidar: options.LidarPreset = None,
    returns: Returns = None,
    fog: Fog = None,
    rain: Rain = 0.0,
    snowfall: Snowfall = 0.0,
    traffic: Annotated[
        int | None, typer.Option(min=0, max=2000, metavar="N")
    ] = None,
    transient: Annotated[
        list[str] | None, typer.Option(metavar="SWITCH=VALUE,...")
    ] = None,
    driver: Literal["real", "none"] | None = None,
    ride: Literal["A", "B", "C", "D", "E", "none"] | None = None,
    imu_rate: Annotated[int | None, typer.Option(metavar="HZ")] = None,
    camera: Annotated[str | None, typer.Option(metavar="WxH@RATE")] = None,
    recording: options.Recording = None,
    graphviz: options.Graphviz = None,
    overwrite: options.Overwrite = False,
) -> None:
    """Simulate a drive and record it.

    The recording is a rosbag2 folder of MCAP.

    Args:
        scenario: A shipped drive, or a scenario file of your own.
        traffic: Numbers of vehicles and of walkers, in place of the scenario's.
        transient: A passing change and its strength: parked_cars, leaves, snow,
            scaffolds, works, furniture, roadsides, seed; may be repeated.
        driver: A driver like those of published drives, who wanders and changes
            lanes, or one who keeps to the middle of his lane.
        ride: Put the car on springs, on a road of a class of ISO 8608 from A
            (new) to E (very poor).
        imu_rate: Samples of the IMU a second, in place of the scenario's.
        camera: A camera that looks ahead, of so many pixels, images a second,
            such as 640x480@2; with depths and classes.
    """
    with uninterrupted():
        from cns_drake.command_line.drive_script import run_drive

    chosen, weather = choose_returns(returns, fog, rain, snowfall)
    run_drive(
        scenario,
        output,
        frames=frames,
        lidar=lidar,
        returns=chosen,
        weather=weather,
        traffic=traffic,
        transient=_switches(transient or ()),
        driver=driver,
        ride=ride,
        imu_rate=imu_rate,
        camera=None if camera is None else _camera_fields(camera),
        recording=recording,
        graphviz=graphviz,
        overwrite=overwrite,
    )


def _camera_fields(text: str) -> dict[str, int]:
    """Returns width, height and rate of `--camera`."""
    match = re.fullmatch(r"(\d{1,9})x(\d{1,9})@(\d{1,9})", text)
    if match is None:
        raise InputError(
            f"--camera: '{text}' is not of the form WxH@RATE, such as 640x480@2"
        )
    width, height, rate = map(int, match.groups())
    return {"width": width, "height": height, "rate": rate}


def _switches(texts: Iterable[str]) -> dict[str, str]:
    """Returns the switches of `--transient` by name."""
    found: dict[str, str] = {}
    for text in texts:
        for item in text.split(","):
            name, equals, value = (part.strip() for part in item.partition("="))
            if not (name and equals and value) or name in found:
                raise InputError(
                    f"--transient: '{item}' is not of the form SWITCH=VALUE, "
                    "such as snow=0.2"
                )
            found[name] = value
    return found


def scan(
    world: Annotated[Path, typer.Argument(metavar="WORLD.sdf")],
    pose: Annotated[
        tuple[float, float, float, float, float, float],
        typer.Option(metavar="X Y Z ROLL PITCH YAW"),
    ],
    output: Annotated[Path, typer.Option()],
    lidar: Annotated[str, options.LIDAR_OPTION] = "cns",
    returns: Returns = None,
    seed: Annotated[int, typer.Option(min=0, metavar="N")] = 0,
    fog: Fog = None,
    rain: Rain = 0.0,
    snowfall: Snowfall = 0.0,
    model_path: Annotated[
        list[Path] | None, typer.Option(metavar="DIR")
    ] = None,
) -> None:
    """Take one scan of any SDF world.

    Args:
        world: Any SDF world.
        pose: The sensor's pose in the world [m, rad].
        output: Where to save: .pcd, .bin or .npy.
        seed: Seed of noise and weather.
        model_path: Folder to search for model://, before GZ_SIM_RESOURCE_PATH
            and SDF_PATH; may be repeated.
    """
    with uninterrupted():
        import numpy as np
        from pydrake.math import RigidTransform, RollPitchYaw

        from cns_drake.base.files import check_writable
        from cns_drake.scene.surfaces import LARGEST_SIZE
        from cns_drake.scene.world import load_world
        from cns_drake.sensors.lidar.config import (
            WeatherConfig,
            make_lidar_config,
            make_pattern,
            make_returns,
        )
        from cns_drake.simulation import scanning

    if not np.isfinite(pose).all():
        raise InputError("--pose: not finite")
    if max(map(abs, pose)) > LARGEST_SIZE:
        raise InputError(f"--pose: {pose} is beyond {LARGEST_SIZE:g} m or rad")
    scanning.check_ending(output)
    check_writable(output)
    config = make_lidar_config(lidar)
    pattern = make_pattern(config)
    X_WS = RigidTransform(RollPitchYaw(*pose[3:]), pose[:3])
    loaded = load_world(world, model_paths=model_path or ())
    for text in loaded.notes:
        note(text)
    chosen, weather = choose_returns(returns, fog, rain, snowfall)
    config = config.replaced(returns=chosen or "ideal")
    model = make_returns(config, weather or WeatherConfig(), "lidar", seed)
    points = scanning.scan_world(loaded, X_WS, pattern, model)
    scanning.save_scan(points, output)
    typer.echo(f"{output}: {len(points)} points")


def generate(
    names: DriveNames = None,
    *,
    output: options.Output,
    frames: options.Frames = None,
    jobs: commands.Jobs = None,
    scheduler: commands.Scheduler = None,
    overwrite: options.Overwrite = False,
    vary: Annotated[Path | None, typer.Option(metavar="FAMILY.yaml")] = None,
) -> None:
    """Record many drives.

    Finished recordings are skipped; interrupted ones go on where they were.

    Args:
        vary: Record the members of a family besides the named drives. Their
            scenario files go to <output>/scenarios, cities of their own to
            <output>/cities.
    """
    with uninterrupted():
        from cns_drake.base.jobs.cluster import choose_cluster
        from cns_drake.scenarios.scenario_files import load_scenario
        from cns_drake.scenarios.shipped import recordable_drives
        from cns_drake.studies.recording import record_all

    cluster = choose_cluster(jobs, scheduler)
    if not names and vary is None:
        names = list(recordable_drives())
    scenarios = [load_scenario(name) for name in names or ()]
    if vary is not None:
        scenarios += family_members(vary, output, cluster)
    if frames is not None:
        scenarios = [s.replaced(frames=frames) for s in scenarios]
    record_all(scenarios, output, cluster, overwrite=overwrite)
    for scenario in scenarios:
        typer.echo(output / scenario.name)
    next_command("cns-eval", "report", output, "--output", "report")


def export(
    drive: Annotated[Path, typer.Argument(metavar="DRIVE")],
    layout: Annotated[
        Literal["cns", "kitti", "mulran", "tum"], typer.Option("--format")
    ],
    output: Annotated[Path, typer.Option()],
    sensor: Annotated[str | None, typer.Option(metavar="NAME")] = None,
    absent_in: Annotated[str | None, typer.Option(metavar="STAGE")] = None,
    sequence: Annotated[
        int | None, typer.Option(metavar="NN", min=0, max=999)
    ] = None,
) -> None:
    """Export a recording to a common layout.

    Args:
        drive: A recorded folder, or its .mcap file.
        layout: Layout: CNS data set, KITTI odometry, MulRan, or TUM (the
            trajectory alone).
        output: Folder of drives: new, empty, or of earlier exports.
        sensor: Name of the LiDAR, if there are several.
        absent_in: Label points on structures that this stage of the map lacks
            with SemanticKITTI's labels of moving objects (252 to 259); with
            kitti.
        sequence: Number of the drive, sequences/NN; with kitti. By default the
            digits at the end of its name.
    """
    with uninterrupted():
        from cns_drake.export.exporting import export_drive

    with show_progress() as progress:
        task = progress.add_task(drive.name, total=None, note="reading")
        drive = export_drive(
            drive,
            layout,
            output,
            lidar=sensor,
            absent_in=absent_in,
            sequence=sequence,
            on_note=note,
            on_frame=count_progress(progress, task),
        )
    typer.echo(drive)
    if layout != "tum":
        next_command(
            *("cns-eval", "pr", drive, drive),
            *("--method", "solid", "--exclude-recent", 30),
        )


def repair(
    file: Annotated[Path, typer.Argument(metavar="FILE")],
    output: Path | None = None,
) -> None:
    """Save what is readable of an MCAP file.

    Args:
        file: Any MCAP file, whole or damaged.
        output: The new file; <name>_repaired.mcap by default.
    """
    with uninterrupted():
        from cns_drake.recording.repair import repair_mcap

    with show_progress() as progress:
        task = progress.add_task(file.name, total=None, note="")
        result = repair_mcap(
            file, output, count_progress(progress, task, unit="bytes")
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
