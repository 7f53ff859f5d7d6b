"""The command `scan`, which takes one scan of any SDF world."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cns_drake.command_line.fields import changed, field_options
from evaluation.base import (
    InputError,
    ended_by_interrupts,
    note,
    shared_options,
    terminal,
)

if TYPE_CHECKING:
    from cns_drake.scenarios import Scenario

GROUP = "Drive through them"

# Fields of a scenario that a single scan has.
_OF_SCAN = ("lidars", "weather", "seed")


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

    Example:
        cns-drake scan worlds/metropolis/stage_01.sdf \\
            --pose 0 0 1.6 0 0 1.57 --output scan.pcd
    """
    with ended_by_interrupts("cns-drake"):
        import numpy as np
        from pydrake.math import RigidTransform, RollPitchYaw

        from cns_drake.scenarios import make_scenario
        from cns_drake.scene import LARGEST_SIZE
        from cns_drake.simulation import scan as take_scan

    if not np.isfinite(pose).all():
        raise InputError("--pose: not finite")
    if max(map(abs, pose)) > LARGEST_SIZE:
        raise InputError(f"--pose: {pose} is beyond {LARGEST_SIZE:g} m or rad")
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
    points = take_scan(
        world,
        RigidTransform(RollPitchYaw(*pose[3:]), pose[:3]),
        scenario.lidars["lidar"],
        weather=scenario.weather,
        seed=scenario.seed,
        model_paths=model_path or (),
        output=output,
        on_note=note,
    )
    terminal.show(
        {"output": str(output), "points": len(points)},
        f"{output}: {len(points)} points",
        json=json,
    )


def _check_fields_of_scan(scenario: Scenario, plain: Scenario) -> None:
    """Checks that only fields are changed that a single scan has.

    Args:
        scenario: the changed scenario of the scan.
        plain: the scenario without changes.
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
