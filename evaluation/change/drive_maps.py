"""Maps of drives and of map files, in one world, for the measure of change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cns_drake.base import InputError
from cns_drake.drives import Drive, Placed
from evaluation.clouds import is_cloud, read_blocks
from evaluation.drives import open_drive
from evaluation.maps import CELL_SIZE, VoxelAccumulator, VoxelMap, map_drive

if TYPE_CHECKING:
    from evaluation.alignment import AlignmentReport, When


@dataclass(frozen=True)
class DriveMap:
    """A map, with the drive that made it.

    Attributes:
        name: name of the drive or file.
        voxels: the map in voxels of 1 m, from which the larger voxels of the
            TCR are made.
        positions: (N, 3) positions of the sensor [m]; None for a map file.
        drive: the drive, or an object with the names of the drive's world frame
            and map; None for a map file.
        notes: notes on how the drive or the file was read.
    """

    name: str
    voxels: VoxelMap
    positions: np.ndarray | None = None
    drive: Placed | None = None
    notes: tuple[str, ...] = ()


def read_map(path: Path) -> DriveMap:
    """Reads a drive or map file, and returns its voxel map.

    Raises:
        InputError: if the path can be read neither as a drive nor as a map.
    """
    return _drive_map_of(open_source(path))


def maps_in_one_world(
    given: Sequence[Drive | Path | str],
    when: When,
    lidar: str | None = None,
    columns: int | None = None,
) -> tuple[list[DriveMap], list[AlignmentReport]]:
    """Returns the maps of drives or map files, all in one world.

    Args:
        given: drives, open or as paths, or paths of map files, which must be in
            the common world.
        when: when all other drives are aligned with the first drive: `auto`
            (only if their world frames differ), `always` or `never`.
        lidar: name of the LiDAR, for recordings with several LiDARs.
        columns: number of columns of `.bin` files, see `read_cloud`.

    Returns:
        The maps, in the given order; and reports on alignments.

    Raises:
        InputError: if a path cannot be read, or a drive cannot be aligned.
    """
    opened = [
        one if isinstance(one, Drive) else open_source(one, lidar, columns)
        for one in given
    ]
    drives = {
        i: source
        for i, source in enumerate(opened)
        if isinstance(source, Drive)
    }
    if when == "always" and len(drives) < len(opened):
        raise InputError("--align always: a map file cannot be aligned")
    if lidar is not None and not drives:
        raise InputError(f"--lidar {lidar}: a map file has no LiDARs")
    reports = []
    if len(drives) > 1:
        # Imported here: it is slow to load, and not needed for map files.
        from evaluation.alignment import in_one_world

        first, *others = drives
        for number, other in enumerate(others):
            alignment = in_one_world(
                drives[first],
                drives[other],
                when,
                hold_first=number > 0,
            )
            if alignment is not None:
                drives[first], drives[other] = alignment.first, alignment.second
                reports.append(alignment.report)
    return [
        _drive_map_of(drives.get(i, source), columns)
        for i, source in enumerate(opened)
    ], reports


def open_source(
    path: Path | str, lidar: str | None = None, columns: int | None = None
) -> Drive | Path:
    """Returns an opened drive, or the path of a point cloud.

    Args:
        path: path of a drive or of a cloud's file.
        lidar: name of the LiDAR, for recordings with several LiDARs.
        columns: number of columns of `.bin` files, see `read_cloud`.

    Raises:
        InputError: if the path cannot be read as a drive or point cloud.
    """
    path = Path(path)
    if path.is_file() and is_cloud(path):
        return path
    return open_drive(path, lidar, columns)


def _drive_map_of(source: Drive | Path, columns: int | None = None) -> DriveMap:
    """Returns the voxel map of a drive or of a cloud's file.

    Args:
        source: the drive, or the path of the file.
        columns: number of columns of a `.bin` file, see `read_cloud`.

    Raises:
        InputError: a scan or the file cannot be read.
    """
    if isinstance(source, Drive):
        voxels = map_drive(source, CELL_SIZE)
        positions = source.X_WS[:, :3, 3]
        return DriveMap(source.name, voxels, positions, source, source.notes)
    accumulator = VoxelAccumulator(CELL_SIZE)
    notes: list[str] = []
    for points in read_blocks(source, columns, notes.append):
        accumulator.add(points)
    return DriveMap(source.name, accumulator.to_map(), notes=tuple(notes))
