"""One drive, run from a diagram script or the command line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
import sys
from typing import TYPE_CHECKING, Literal

from cns_drake.base import (
    errors_at_option,
    program,
    show_progress,
    terminal,
    uninterrupted,
)
from cns_drake.command_line import options
from cns_drake.command_line.suggestions import suggest_export

if TYPE_CHECKING:
    from cns_drake.scenarios import Scenario
    from cns_drake.sensors import WeatherConfig
    from cns_drake.simulation import FinishedSimulation


def import_simulation() -> Callable[..., FinishedSimulation]:
    """Imports the simulation, which is slow and not needed for `--help`."""
    from cns_drake.simulation import simulate

    return simulate


def run_drive(
    name_or_file: str,
    output: Path | str,
    *,
    frames: int | None = None,
    lidar: str | None = None,
    returns: Literal["ideal", "calibrated"] | None = None,
    weather: WeatherConfig | None = None,
    traffic: int | None = None,
    transient: Mapping[str, float | str] | None = None,
    driver: Literal["real", "none"] | None = None,
    ride: str | None = None,
    imu_rate: int | None = None,
    camera: Mapping[str, int] | None = None,
    recording: Path | str | None = None,
    beside: Path | str | None = None,
    graphviz: Path | str | None = None,
    overwrite: bool = False,
    json: bool = False,
) -> FinishedSimulation:
    """Simulates and records a drive, and shows on stderr what it does.

    All cores are used. `simulate` does the same for a scenario that is already
    loaded, and shows nothing.

    Args:
        name_or_file: name of a shipped drive, or a scenario file.
        output: folder for the recordings.
        frames: number of frames to record, from the start; by default all.
        lidar: preset, or file of a data sheet, that replaces the LiDARs of the
            scenario.
        returns: `ideal` or `calibrated`, the model of the LiDARs' returns; by
            default as the scenario says.
        weather: weather; by default the weather of the scenario.
        traffic: number of vehicles, and also of pedestrians; by default as the
            scenario says.
        transient: switch -> value in the section `transient`; by default as the
            scenario says.
        driver: `real` for a driver who wanders and changes lanes, or `none` for
            a driver who stays in the middle of the lane; by default as the
            scenario says.
        ride: class of the road surface after ISO 8608, `A` to `E`, or `none`
            for a car that stays steady; by default as the scenario says.
        imu_rate: samples of the IMU per second; by default as the scenario
            says.
        camera: fields of an additional camera, named `camera`, which also
            records depth and label images; by default no camera is added.
        recording: file for a web page of the drive, if any.
        beside: page of another drive in the same city, which the page of this
            drive then shows as well.
        graphviz: file for the Diagram as Graphviz text, if any.
        overwrite: whether to replace an existing recording.
        json: whether to print the result as JSON.

    Raises:
        InputError: an argument cannot be used.

    Example:
        from cns_drake import run_drive

        run_drive("downtown_01", "recordings", frames=20)
    """
    from cns_drake.base import num_cores
    from cns_drake.scenarios import load_scenario

    with uninterrupted():
        simulate = import_simulation()
    scenario = _changed_scenario(
        load_scenario(name_or_file),
        lidar=lidar,
        returns=returns,
        weather=weather,
        traffic=traffic,
        transient=transient,
        driver=driver,
        ride=ride,
        imu_rate=imu_rate,
        camera=camera,
    )
    if frames is not None:
        scenario = scenario.replaced(frames=frames)
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


def _changed_scenario(
    scenario: Scenario,
    *,
    lidar: str | None,
    returns: Literal["ideal", "calibrated"] | None,
    weather: WeatherConfig | None,
    traffic: int | None,
    transient: Mapping[str, float | str] | None,
    driver: Literal["real", "none"] | None,
    ride: str | None,
    imu_rate: int | None,
    camera: Mapping[str, int] | None,
) -> Scenario:
    """Returns a scenario with the changes that `run_drive` takes."""
    if lidar is not None:
        with errors_at_option("--lidar", "unit"):
            scenario = scenario.with_lidar(lidar)
    if returns is not None:
        scenario = scenario.with_returns(returns, weather)
    if traffic is not None:
        scenario = scenario.with_traffic(traffic)
    if transient:
        scenario = scenario.with_transient(**transient)
    if driver is not None:
        scenario = scenario.with_driver(driver)
        if driver == "real" and scenario.waypoints is not None:
            terminal.note("--driver real: waypoints have no lanes to change to")
    if ride is not None:
        change: dict = {"ride": {"roughness": ride}}
        scenario = scenario.with_fields(change, "--ride")
    if imu_rate is not None:
        change = {"imu": {"rate": imu_rate}}
        scenario = scenario.with_fields(change, "--imu-rate")
    if camera is not None:
        fields = {"depth": True, "label": True, **camera}
        scenario = scenario.with_fields(
            {"cameras": {"camera": fields}}, "--camera"
        )
    return scenario


def run_script(name: str, description: str) -> None:
    """Runs the command line of a diagram script: records one drive.

    Args:
        name: name of the drive.
        description: the script's docstring, shown by `--help`.

    Example:
        from cns_drake import run_script

        run_script("downtown_01", "Downtown before it was built up.")
    """

    def script(
        output: options.Output = Path("recordings"),
        frames: options.Frames = None,
        lidar: options.LidarUnit = None,
        traffic: options.Traffic = None,
        recording: options.Recording = None,
        graphviz: options.Graphviz = None,
        overwrite: options.Overwrite = False,
    ) -> None:
        run_drive(
            name,
            output,
            frames=frames,
            lidar=lidar,
            traffic=traffic,
            recording=recording,
            graphviz=graphviz,
            overwrite=overwrite,
        )

    app = program.plain_app(add_completion=False)
    epilog = program.example(f"python diagrams/{name}.py --frames 200")
    app.command(
        help=description,
        epilog=epilog,
        context_settings=program.WIDE_HELP,
    )(script)
    program.run(app, Path(sys.argv[0]).name, show_progress())
