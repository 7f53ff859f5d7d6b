"""All that a report needs of one recording, found in one go."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from evaluation.errors import InputError
from evaluation.mapped_sequence import MappedSequence
from evaluation.maps import PICTURE_DIVISIONS, VOXEL_SIZE, VoxelMap
from evaluation.methods import known_methods, make_method
from evaluation.page_data import PageDrive, make_drive
from evaluation.retrieval import DescribedDrive, Role, describe_drive
from evaluation.sequences import open_sequence
from evaluation.thumbnails import thumbnail


@dataclass(frozen=True)
class RecordingSurvey:
    """A recording's maps, places and queries; no scan is needed any more.

    Attributes:
        name: of the recording.
        fine: map for pictures.
        coarse: map on the grid of the TCR.
        positions: (N, 3) of the sensor along the drive [m].
        described: method -> what it keeps of the drive; empty if the
            recording has no role.
        page: the drive as the page shows it.
    """

    name: str
    fine: VoxelMap
    coarse: VoxelMap
    positions: np.ndarray
    described: dict[str, DescribedDrive]
    page: PageDrive


def survey_recording(path: Path, roles: Set[Role]) -> RecordingSurvey:
    """Maps a recording and describes its places and queries.

    Args:
        path: of the recording.
        roles: what it serves as in place recognition; may be empty.

    Raises:
        InputError: if it cannot be read, or holds no point.
    """
    frames, thumbnails = [], []
    methods = [make_method(name, {}) for name in known_methods()]
    sequence = MappedSequence(
        open_sequence(path),
        VOXEL_SIZE / PICTURE_DIVISIONS,
        kept=max(method.scans_per_place for method in methods),
    )

    def keep_thumbnail(frame: int, cloud: np.ndarray) -> None:
        frames.append(frame)
        height = methods[0].config.sensor_height
        thumbnails.append(thumbnail(cloud, height, seed=frame))

    described = {}
    if roles:
        drives = describe_drive(sequence, methods, roles, visit=keep_thumbnail)
        described = {
            method.name: drive
            for method, drive in zip(methods, drives, strict=True)
        }
    fine = sequence.finish()
    if len(fine) == 0:
        raise InputError(f"{sequence.name}: no scan holds a point")
    return RecordingSurvey(
        name=sequence.name,
        fine=fine,
        coarse=fine.coarsen(PICTURE_DIVISIONS),
        positions=sequence.X_WS[:, :3, 3],
        described=described,
        page=make_drive(sequence.name, fine, sequence.X_WS, frames, thumbnails),
    )
