"""Whether the poses of two drives are in the same world."""

from pathlib import Path

from evaluation.base import InputError
from evaluation.drives.drive import Drive


def check_same_world(
    first: Drive, second: Drive, *, across_maps: bool = False
) -> None:
    """Raises an error if the poses of two drives cannot be compared.

    The drives must name the same world frame and, unless `across_maps`, the
    same map.

    Raises:
        InputError: if the drives name different world frames, or different
            maps.
    """
    if first.world != second.world:
        frames = first.world_frame, second.world_frame
        if frames[0] == frames[1]:  # Each is of one drive.
            frames = first.world, second.world
        raise InputError(
            f"{second.name}: poses in frame {frames[1]!r}, those of"
            f" {first.name} in {frames[0]!r}{second.placing}"
        )
    if not across_maps:
        check_same_map(first, second)


def check_same_map(first: Drive, second: Drive) -> None:
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
            f"{second.name}: a drive through {maps[1]}, but {first.name} is"
            f" one through {maps[0]} (cns-eval pr --across-maps compares cities"
            " along the same streets)"
        )
