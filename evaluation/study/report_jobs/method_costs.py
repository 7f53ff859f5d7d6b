"""Measures the costs of methods for a report, after all its other jobs."""

import numpy as np

from cns_drake.base.jobs.step import Reporter
from evaluation.drives.drive_views import MovedDrive
from evaluation.drives.scan_clouds import cloud_at
from evaluation.recognition.costs import NUM_TRIALS, Cost, measure_cost
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.place_measurements import PlaceComparison
from evaluation.study.sources import DriveSource
from evaluation.study.storage.parts import Part
from evaluation.study.tasks.place import measure_costs


def measure_method_costs(
    reporter: Reporter,
    source: DriveSource,
    summary: Part,
    methods: tuple[MethodChoice, ...],
    described: tuple[tuple[Part, ...], tuple[Part, ...]],
    protocol: RetrievalProtocol,
) -> list[Cost]:
    """Returns the time and memory that each method needs on one core.

    The cost of a search is the result of the task `cost`; the time to describe
    a cloud is added.

    Args:
        reporter: reports progress.
        source: opens the query drive.
        summary: file with the `DriveSummary` of the query drive, from which
            the drive's poses are read.
        methods: the methods.
        described: files with the scans and descriptors of a database, and of
            the queries; see `PlaceComparison`.
        protocol: protocol of the comparison.
    """
    compared = PlaceComparison(*described, methods, protocol, ())
    searches = measure_costs(reporter, compared)
    drive = source()
    known = summary.read()
    # A recording would be unpacked as a whole for its poses.
    drive = MovedDrive(drive, known.X_WS, drive.world_frame, drive.datum)
    costs = []
    for choice in methods:
        method = choice.make()
        number = protocol.scans(method)
        last = max(len(drive) - number, 0)
        clouds = [
            cloud_at(
                drive,
                frame,
                number,
                protocol.max_range,
                method.point_fields,
                protocol.scans_before(method),
            )
            for frame in np.linspace(0, last, NUM_TRIALS).astype(int).tolist()
        ]
        search = searches[choice.key]
        costs.append(measure_cost(method, clouds, number, search))
    return costs
