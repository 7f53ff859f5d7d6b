"""Measures the costs of methods for a report, after all its other jobs."""

import numpy as np
from threadpoolctl import threadpool_limits

from cns_drake.base.jobs.step import Reporter
from cns_drake.base.progress import track
from evaluation.drives.drive_views import MovedDrive
from evaluation.drives.sampling import gather
from evaluation.recognition.costs import Cost, measure_cost
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.parts import Part
from evaluation.study.surveys import DriveSource

# Number of clouds and of queries whose costs are measured; the time of the
# first does not count.
_NUM_TRIALS = 12


def measure_method_costs(
    reporter: Reporter,
    source: DriveSource,
    surveyed: Part,
    methods: tuple[MethodChoice, ...],
    described: tuple[tuple[Part, Part], ...],
    protocol: RetrievalProtocol,
) -> list[Cost]:
    """Returns the time and memory that each method needs on one core.

    Args:
        reporter: reports progress.
        source: opens the query drive.
        surveyed: file with the `SurveyedDrive` of the query drive, from which
            the drive's poses are read.
        methods: the methods.
        described: files with each method's descriptions of a database and of
            the query.
        protocol: protocol of the comparison.
    """
    drive = source()
    known = surveyed.read()
    # A recording would be unpacked as a whole for its poses.
    drive = MovedDrive(drive, known.X_WS, drive.world_frame, drive.datum)
    costs = []
    with threadpool_limits(limits=1):
        for choice, parts in track(
            zip(methods, described, strict=True),
            "measuring costs",
            len(methods),
            "methods",
        ):
            method = choice.make()
            number = protocol.scans(method)
            last = max(len(drive) - number, 0)
            frames = np.linspace(0, last, _NUM_TRIALS).astype(int).tolist()
            clouds = [
                gather(
                    drive,
                    frame,
                    number,
                    protocol.max_range,
                    method.point_fields,
                    protocol.scans_before(method),
                )
                for frame in frames
            ]
            (_, database), (_, query) = (part.read() for part in parts)
            costs.append(
                measure_cost(
                    method,
                    clouds,
                    number,
                    database,
                    query,
                    protocol.gate_radius,
                )
            )
    return costs
