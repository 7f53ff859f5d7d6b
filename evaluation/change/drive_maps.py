"""Maps of drives and of map files, for the measure of change."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cns_drake.drives import Drive
from evaluation.clouds import read_blocks
from evaluation.maps import CELL_SIZE, VoxelAccumulator, VoxelMap, map_drive


@dataclass(frozen=True)
class DriveMap:
    """A map, with the drive that made it.

    Attributes:
        name: name of the drive or file.
        voxels: the map in voxels of 1 m, from which the larger voxels of the
            TCR are made.
        positions: (N, 3) positions of the sensor [m]; None for a map file.
        drive: the drive, if it is open; None for a map file.
        notes: notes on how the file was read.
    """

    name: str
    voxels: VoxelMap
    positions: np.ndarray | None = None
    drive: Drive | None = None
    notes: tuple[str, ...] = ()


def map_source(source: Drive | Path, columns: int | None = None) -> DriveMap:
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
        return DriveMap(source.name, voxels, positions, source)
    accumulator = VoxelAccumulator(CELL_SIZE)
    notes: list[str] = []
    for points in read_blocks(source, columns, notes.append):
        accumulator.add(points)
    return DriveMap(source.name, accumulator.to_map(), notes=tuple(notes))
