"""Whether the poses of two drives are in the same world."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cns_drake.base import InputError
from cns_drake.drives.drive import Drive


@dataclass(frozen=True)
class DriveNames:
    """Name, world frame and map of a drive, without its scans.

    Use this object instead of an open drive to check whether two drives have
    the same world (`check_same_world`). Only the field `map` of the scenario is
    kept.
    """

    name: str
    world_frame: str
    scenario: Mapping | None

    @classmethod
    def of(cls, drive: Drive) -> DriveNames:
        """Returns the name, the world frame and the map of a drive."""
        scenario = drive.scenario
        if scenario is not None:
            scenario = {k: v for k, v in scenario.items() if k == "map"}
        return cls(drive.name, drive.world_frame, scenario)


# Drives, open or not, whose poses are in a named world frame.
Placed = Drive | DriveNames


def check_same_world(
    first: Placed, second: Placed, *, across_maps: bool = False
) -> None:
    """Raises an error if the poses of two drives cannot be compared.

    The drives must name the same world frame and, unless `across_maps`, the
    same map.

    Raises:
        InputError: if the drives name different world frames, or different
            maps.
    """
    frames = first.world_frame, second.world_frame
    if frames[0] != frames[1]:
        advice = ""
        if any(frame.startswith("kitti/") for frame in frames):
            advice = (
                " (a first_pose.txt in a drive's folder says where in the map"
                " its first scan was taken)"
            )
        raise InputError(
            f"{second.name}: poses in frame {frames[1]!r}, those of"
            f" {first.name} in {frames[0]!r}{advice}"
        )
    if not across_maps:
        check_same_map(first, second)


def check_same_map(first: Placed, second: Placed) -> None:
    """Raises an error if two drives name different maps.

    Raises:
        InputError: if they name different maps.
    """
    maps = []
    for drive in (first, second):
        place = (drive.scenario or {}).get("map")
        # Its name may be a path.
        maps.append(None if place is None else Path(str(place)).name)
    if None not in maps and maps[0] != maps[1]:
        raise InputError(
            f"{second.name}: a drive through {maps[1]}, but {first.name} is "
            f"one through {maps[0]}"
        )
