"""The command `film`, which shows a drive in every stage of its city."""

from pathlib import Path
import re
from typing import Annotated

import typer

from cns_drake.command_line.suggestions import suggest_page
from evaluation.base import (
    InputError,
    ended_by_interrupts,
    note,
    shared_options,
    terminal,
)

GROUP = "Drive through them"


def film(
    scenario: Annotated[str, typer.Argument(metavar="NAME|SCENARIO.yaml")],
    output: Annotated[Path, typer.Option(metavar="FILE")],
    seconds: Annotated[
        float, typer.Option(min=1.0, max=60.0, metavar="S")
    ] = 20.0,
    size: Annotated[str, typer.Option(metavar="WxH")] = "640x360",
    start_time: Annotated[
        float | None, typer.Option(min=0.0, metavar="S")
    ] = None,
    traffic: Annotated[int | None, typer.Option(min=0, metavar="N")] = None,
    json: shared_options.Json = False,
) -> None:
    """Make a film of a drive in every stage of its city.

    The film shows one stretch of the drive. It begins with one shot per stage
    from behind the car, with the points that the LiDAR measures. Then follows
    one shot per stage from above.

    Args:
        scenario: Name of a shipped drive, or a scenario file.
        output: File to write, which is replaced; its name ends in .webp, or in
            .mp4, which needs ffmpeg.
        seconds: Length of the whole film, with all of its shots [s].
        size: Width and height of the film in pixels, each from 32 to 1920.
        start_time: Time in the drive at which the filmed stretch begins [s]. By
            default, the film shows the stretch of the drive whose two ends lie
            farthest apart.
        traffic: Number of vehicles of the map's recorded traffic in the film.
            The same number of pedestrians is added. By default the traffic of
            the scenario, or 60 if it has none.

    Example:
        cns-drake film metropolis_01 --output film.webp
    """
    with ended_by_interrupts("cns-drake"):
        from cns_drake.scenarios import load_scenario
        from cns_drake.simulation import make_film

    drive = load_scenario(scenario)
    match = re.fullmatch(r"(\d{1,4})x(\d{1,4})", size)
    width, height = map(int, match.groups()) if match else (0, 0)
    if not (32 <= width <= 1920 and 32 <= height <= 1920):
        raise InputError(
            f"--size: '{size}' is not of the form WxH with 32 to 1920 pixels, "
            "such as 640x360"
        )
    number = make_film(
        drive,
        output,
        seconds=seconds,
        size=(width, height),
        start=start_time,
        traffic=traffic,
        on_note=note,
    )
    terminal.show(
        {"output": str(output), "images": number},
        f"{output}: {number} images",
        json=json,
    )
    suggest_page(drive, scenario)
