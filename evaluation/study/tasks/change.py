"""The task `change`: how much the city changed between two drives."""

from collections.abc import Iterator, Mapping
import math
from typing import Any, ClassVar

import numpy as np

from cns_drake.base.jobs.step import Reporter
from evaluation.change.drive_change import Surveyed, compare_maps
from evaluation.drives.sampling import sample_frames
from evaluation.maps.voxel_maps import CELL_SIZE, VoxelMap, map_drive
from evaluation.recognition.place_outcome import Number
from evaluation.study.parts import Part
from evaluation.study.surveys import DriveSource
from evaluation.study.tasks.task import (
    Jobs,
    NamedDrive,
    Pair,
    Task,
    positive,
)

# Expected seconds to map a drive with each of its scans, or with some.
_WHOLE_COST, _COST = 60.0, 20.0


class ChangeTask(Task):
    """Measures the change (TCR_sym) between two drives or their cities.

    The query drive is compared with a drive on the same route through the
    database's city, so that only the city differs. If there is no such drive,
    the query drive is compared with the database drive.
    """

    name = "change"
    defaults: ClassVar[Mapping[str, Any]] = {"spacing": None}

    def check(self, name: str, value: Any, where: str) -> None:
        if value is not None:
            positive(value, where)

    def measure(self, pair: Pair, jobs: Jobs) -> Part:
        spacing = self.settings["spacing"]
        needs: list[str] = []

        def mapped(drive: NamedDrive) -> Part:
            name = (
                drive.name if spacing is None else f"{drive.name} {spacing:g}"
            )
            part = jobs.files.part("mapped", name)
            needs.append(f"mapped {part.path.stem}")
            cost = _WHOLE_COST if spacing is None else _COST
            return jobs.add(part, map_city, (drive.source, spacing), cost=cost)

        maps = mapped(pair.way), mapped(pair.query)
        part = jobs.files.part("change", pair.name)
        return jobs.add(part, measure_change, maps, needs, 2.0)

    def numbers(self, found: Any, before: Any | None) -> Iterator[Number]:
        for name, (value, number) in found.items():
            if not math.isnan(value):
                yield Number("", False, name, value, n=number)


def map_city(
    reporter: Reporter, source: DriveSource, spacing: float | None
) -> tuple[VoxelMap, np.ndarray]:
    """Returns the voxel map of a drive, to compute the change ratio (TCR).

    Args:
        reporter: reports progress.
        source: function that opens the drive.
        spacing: distance along the path between two scans in the map [m]; None
            for all scans.

    Returns:
        The map, and positions (N, 3) of the sensor at all frames [m].
    """
    drive = source()
    positions = drive.X_WS[:, :3, 3]
    frames = None
    if spacing is not None:
        frames = sample_frames(positions, spacing).tolist()
    return map_drive(drive, CELL_SIZE, frames), positions


def measure_change(
    reporter: Reporter, first: Part, second: Part
) -> dict[str, tuple[float, int]]:
    """Returns how much changed between two drives.

    Args:
        reporter: reports progress.
        first, second: files with the results of `map_city` for the two drives.

    Returns:
        Name of a metric, such as `tcr_sym` -> pair of its value and the number
        of voxels from which the value is computed.
    """
    return changes_of(
        *(
            Surveyed(name, *part.read())
            for name, part in (("database", first), ("query", second))
        )
    )


def changes_of(a: Surveyed, b: Surveyed) -> dict[str, tuple[float, int]]:
    """Returns how much changed between two maps, as `measure_change` does."""
    # The spread over grids is not reported: it would take sixteen times as
    # long.
    report = compare_maps(a, b, grids=())
    found = {}
    for name, change in (
        ("tcr_sym", report.change),
        ("tcr_sym_masked", report.masked),
    ):
        if change is not None:
            found[name] = float(change.symmetric), change.num_in_hull
    for name, side in (
        ("tcr_source_to_target", report.change.source_to_target),
        ("tcr_target_to_source", report.change.target_to_source),
    ):
        found[name] = float(side.ratio), side.num_in_hull
    return found


def surveyed_change(
    reporter: Reporter, first: Part, second: Part
) -> dict[str, tuple[float, int]]:
    """Returns how much changed between two drives that were surveyed.

    Args:
        reporter: unused.
        first, second: files with the `SurveyedDrive` of the database and of the
            query.

    Returns:
        As `measure_change`.
    """
    drives = [part.read() for part in (first, second)]
    return changes_of(
        *(Surveyed(one.name, one.coarse, one.positions) for one in drives)
    )
