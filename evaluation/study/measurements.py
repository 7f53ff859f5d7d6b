"""Measurements between two surveyed recordings."""

import numpy as np
from threadpoolctl import threadpool_limits

from cns_drake.base.jobs.step import Reporter
from evaluation.change.drive_change import ChangeResult, Surveyed
from evaluation.change.drive_change import compare as compare_maps
from evaluation.drives import check_same_world
from evaluation.drives.drive_views import MovedDrive
from evaluation.drives.sampling import gather
from evaluation.recognition import place_recognition
from evaluation.recognition.costs import Cost, measure_cost
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.retrieval import compare as score
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.parts import Part
from evaluation.study.surveys import DriveSource, SurveyedDrive

# Number of clouds and of queries whose costs are measured; the time of the
# first does not count.
_NUM_TRIALS = 12


def measure_change(
    reporter: Reporter,
    map_name: str,
    stages: tuple[str, str],
    drives: tuple[Part, ...],
) -> ChangeResult:
    """Returns the change between two drives; they must be of one world.

    The earlier, the later and maybe a control are each a `SurveyedDrive`.
    """
    del reporter
    read: list[SurveyedDrive] = [part.read() for part in drives]
    earlier, later, *controls = (
        Surveyed(one.name, one.coarse, one.positions, one.placed)
        for one in read
    )
    control = controls[0] if controls else None
    report = compare_maps(earlier, later, control)
    return ChangeResult(map_name, stages, report)


def recognise_places(
    reporter: Reporter,
    map_name: str,
    stages: tuple[str, str],
    described: tuple[Part, Part],
    choice: MethodChoice,
    protocol: RetrievalProtocol,
) -> place_recognition.RecognitionResult | None:
    """Returns the result of a method on two drives of one world.

    It is None if a drive is compared with itself and closes no loop.

    Args:
        reporter: reports progress.
        map_name: name of the map.
        stages: stages of the database and of the query.
        described: descriptions of the database and of the query.
        choice: the method.
        protocol: protocol of the comparison.
    """
    # The method comes first, because it registers the type of its
    # descriptions.
    method = choice.make()
    (placed, database), (placed_query, query) = (p.read() for p in described)
    check_same_world(placed, placed_query)
    retrieval = score(method, database, query, protocol, reporter.track)
    if database.name == query.name and not retrieval.matches.any():
        # A route need not close a loop.
        reporter.note(f"{query.name}: it never comes back to where it was")
        return None
    outcome = place_recognition.judge_retrieval(
        method, database.name, query.name, retrieval, protocol
    )
    return place_recognition.RecognitionResult.of(map_name, stages, outcome)


def measure_costs(
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
        surveyed: survey of the query drive, with its poses.
        methods: the methods.
        described: descriptions of a database and the query, by each method.
        protocol: protocol of the comparison.
    """
    drive, known = source(), surveyed.read()
    # A recording would be unpacked as a whole for its poses.
    drive = MovedDrive(drive, known.X_WS, drive.world_frame, drive.datum)
    costs = []
    with threadpool_limits(limits=1):
        for choice, parts in reporter.track(
            zip(methods, described, strict=True), "", len(methods)
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
