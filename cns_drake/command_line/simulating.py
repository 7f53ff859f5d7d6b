"""The commands `simulate`, `scan` and `generate`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
import re
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cns_drake.base import (
    InputError,
    doing,
    ended_by_interrupts,
    errors_at_option,
    next_command,
    note,
    shared_options,
    show,
)
from cns_drake.command_line import options
from cns_drake.command_line.experiment_drives import varied_drives

if TYPE_CHECKING:
    from cns_drake.sensors import WeatherConfig

ReturnsModel = Literal["ideal", "calibrated"]
Returns = Annotated[
    ReturnsModel | None,
    typer.Option(
        help="Model of the LiDAR's returns. ideal returns are exact; "
        "calibrated returns have the noise, the losses and the intensities of "
        "the LiDAR's data sheet. By default the model that the scenario sets; "
        "without a scenario, ideal."
    ),
]
DriveNames = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="NAME",
        help="Names of shipped drives, or scenario files. If you name none, "
        "the drives of the experiment that --vary names are recorded, or all "
        "shipped drives if --vary is not given.",
    ),
]
Fog = Annotated[
    float | None,
    typer.Option(
        metavar="METRES",
        help="Visibility in fog [m]; a lower visibility means denser fog. "
        "Fog, rain and snowfall switch on calibrated returns.",
    ),
]
Rain = Annotated[
    float,
    typer.Option(
        metavar="MM_H",
        help="Rain rate [mm/h]. Rain switches on calibrated returns.",
    ),
]
Snowfall = Annotated[
    float,
    typer.Option(
        metavar="MM_H",
        help="Snowfall rate, as melted water [mm/h]. Snowfall switches on "
        "calibrated returns.",
    ),
]


def choose_returns(
    returns: ReturnsModel | None,
    fog: float | None,
    rain: float,
    snowfall: float,
) -> tuple[ReturnsModel | None, WeatherConfig | None]:
    """Returns the model of LiDAR returns and the weather, from options.

    Args:
        returns: the option --returns; None if the user has not given the
            option.
        fog: visibility in fog [m]; None for no fog.
        rain: rain rate [mm/h].
        snowfall: snowfall rate, as melted water [mm/h].

    Returns:
        The model and the weather. Each is None if no option sets it, so that
        the scenario decides.

    Raises:
        InputError: a value is out of range; the message names its option.
    """
    if fog is None and not rain and not snowfall:
        return returns, None
    from pydantic import ValidationError

    from cns_drake.sensors import WeatherConfig

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
    lidar: options.LidarUnit = None,
    returns: Returns = None,
    fog: Fog = None,
    rain: Rain = 0.0,
    snowfall: Snowfall = 0.0,
    traffic: options.Traffic = None,
    transient: Annotated[
        list[str] | None, typer.Option(metavar="SWITCH=VALUE,...")
    ] = None,
    driver: Literal["real", "none"] | None = None,
    ride: Literal["A", "B", "C", "D", "E", "none"] | None = None,
    imu_rate: Annotated[int | None, typer.Option(metavar="HZ")] = None,
    camera: Annotated[str | None, typer.Option(metavar="WxH@RATE")] = None,
    recording: options.Recording = None,
    beside: Annotated[Path | None, typer.Option(metavar="PAGE.html")] = None,
    graphviz: options.Graphviz = None,
    overwrite: options.Overwrite = False,
    json: shared_options.Json = False,
) -> None:
    """Simulate a drive and record it.

    Writes a rosbag2 folder, which ROS 2 tools can read. The folder contains a
    file with metadata, and an MCAP file with the scans, the poses and the data
    of all other sensors.

    Args:
        scenario: Name of a shipped drive, as cns-drake list shows it, or a
            scenario file of your own.
        transient: Temporary changes to the city, such as snow=0.25,leaves=0.15.
            The switches are snow (depth of the snow [m]), leaves (share of the
            leaves that trees keep), parked_cars, scaffolds, works, furniture
            and roadsides (share of these things that is changed or added, from
            0 to 1; roadsides above 1 has more plants), height_limit (greatest
            height of buildings and plants [m]) and seed (an integer that
            selects the random changes). May be repeated.
        driver: Model of the driver. With real, the car wanders in its lane and
            changes lanes, as in published data sets. With none, the car stays
            in the middle of its lane. By default the driver of the scenario.
        ride: Roughness of the road that shakes the car on its springs, as a
            class of ISO 8608 from A (new) to E (very poor). With none, the car
            does not shake. By default the class that the scenario sets.
        imu_rate: Sampling rate of the IMU [Hz]; by default the rate that the
            scenario sets.
        camera: Add a camera that looks ahead: width and height of an image in
            pixels, and images per second, such as 640x480@2. The camera also
            records depth images and images of semantic classes.
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
    chosen, weather = choose_returns(returns, fog, rain, snowfall)
    drive_script.run_drive(
        scenario,
        output,
        frames=frames,
        lidar=lidar,
        returns=chosen,
        weather=weather,
        traffic=traffic,
        transient=_transient_switches(transient or ()),
        driver=driver,
        ride=ride,
        imu_rate=imu_rate,
        camera=None if camera is None else _camera_fields(camera),
        recording=recording,
        beside=beside,
        graphviz=graphviz,
        overwrite=overwrite,
        json=json,
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


def _transient_switches(texts: Iterable[str]) -> dict[str, str]:
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
    json: shared_options.Json = False,
) -> None:
    """Take one LiDAR scan of an SDF world.

    Args:
        world: SDF file of the world to scan.
        pose: Pose of the LiDAR in the world: position, then roll, pitch and yaw
            [m, rad].
        output: File for the scan; its name ends in .pcd, .bin or .npy. An
            existing file is replaced.
        seed: Seed of the random noise and weather. A different seed gives
            different errors with the same statistics.
        model_path: Folder with the world's model:// files. The command searches
            this folder before the folders in the environment variables
            GZ_SIM_RESOURCE_PATH and SDF_PATH. May be repeated.
    """
    with ended_by_interrupts("cns-drake"):
        import numpy as np
        from pydrake.math import RigidTransform, RollPitchYaw

        from cns_drake.base import check_writable
        from cns_drake.scene import LARGEST_SIZE, load_world
        from cns_drake.sensors import make_lidar_config, make_lidar_model
        from cns_drake.simulation import check_ending, save_scan, scan_world

    if not np.isfinite(pose).all():
        raise InputError("--pose: not finite")
    if max(map(abs, pose)) > LARGEST_SIZE:
        raise InputError(f"--pose: {pose} is beyond {LARGEST_SIZE:g} m or rad")
    check_ending(output)
    check_writable(output)
    with errors_at_option("--lidar", "unit"):
        config = make_lidar_config(lidar)
    X_WS = RigidTransform(RollPitchYaw(*pose[3:]), pose[:3])
    doing(f"reading {world.name}")
    loaded = load_world(world, model_paths=model_path or ())
    for text in loaded.notes:
        note(text)
    chosen, weather = choose_returns(returns, fog, rain, snowfall)
    config = config.replaced(returns=chosen or "ideal")
    model = make_lidar_model(config, "lidar", seed, weather)
    doing("casting rays")
    points = scan_world(loaded, X_WS, model.pattern, model.returns)
    save_scan(points, output)
    show(
        {"output": str(output), "points": len(points)},
        f"{output}: {len(points)} points",
        json=json,
    )


def generate(
    names: DriveNames = None,
    *,
    output: options.Output,
    frames: options.Frames = None,
    jobs: shared_options.Jobs = None,
    scheduler: shared_options.Scheduler = None,
    overwrite: options.Overwrite = False,
    vary: options.Vary = None,
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
    if frames is not None:
        scenarios = [s.replaced(frames=frames) for s in scenarios]
    record_all(scenarios, output, cluster, overwrite=overwrite)
    for scenario in scenarios:
        typer.echo(output / scenario.name)
    next_command("cns-eval", "report", output, "--output", "report")
