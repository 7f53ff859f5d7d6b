"""The command `simulate`, which records one drive."""

from pathlib import Path
from typing import Annotated, Any

import typer

from cns_drake.command_line import options
from cns_drake.command_line.fields import field_options
from evaluation.base import InputError, ended_by_interrupts, shared_options

GROUP = "Drive through them"


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
        beside: Page that --recording wrote of another drive in the same city.
            The new page then shows both side by side: when you move in one, the
            other goes to the same place.

    Example:
        cns-drake simulate metropolis_01 --output drives
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
