"""Numbers of a pair of drives from their definitions, without an engine.

They are oracles for the engine's tables: each is a plain sequence of the steps
that CONTRIBUTING.md names.
"""

from dataclasses import replace

import numpy as np

from evaluation.change import (
    ChangeReport,
    DriveMap,
    change_of_maps,
    same_stage_partner,
    spread_over_grids,
)
from evaluation.drives import Drive
from evaluation.methods import Method
from evaluation.recognition import (
    RECORDED_PROTOCOL,
    Mode,
    PlaceOutcome,
    QueryDrive,
    RetrievalProtocol,
    check_has_match,
    retrieve,
)


def place_outcome(
    database: Drive,
    query: Drive,
    method: Method,
    protocol: RetrievalProtocol = RECORDED_PROTOCOL,
    *,
    across_maps: bool = False,
    overlaps: np.ndarray | None = None,
) -> PlaceOutcome:
    """Returns the outcome of a method on a pair of drives.

    Args:
        database, query: the drives.
        method: the method.
        protocol: protocol of the comparison.
        across_maps: whether the drives may be from maps with different names.
        overlaps: (Q, D) share of each query's scan that each place's scan
            shows; by default computed from the scans.
    """
    found = retrieve(
        database,
        query,
        method,
        protocol,
        across_maps=across_maps,
        overlaps=overlaps,
    )
    frames = found.query_frames
    outcome = PlaceOutcome.of(
        method.name,
        method,
        protocol,
        found,
        QueryDrive(
            query.name, query.stamps_ns[frames], query.X_WS[frames, :3, 3]
        ),
        [database.name] * len(found.database_frames),
    )
    check_has_match(outcome)
    return outcome


def values_of(
    outcome: PlaceOutcome, task: str = "place", mode: Mode = "all"
) -> dict[str, float]:
    """Returns name -> value of each metric of a task."""
    return {n.metric: n.value for n in outcome.numbers(task, mode=mode)}


def compare_maps(
    source: DriveMap,
    target: DriveMap,
    control: DriveMap | None = None,
) -> ChangeReport:
    """Returns the change between two maps A and B.

    Args:
        source: the map A.
        target: the map B.
        control: map of a third drive, which follows the route of A in the stage
            of B, or the route of B in the stage of A; None for no control.
    """
    report = change_of_maps(source, target)
    if control is not None:
        both = control, same_stage_partner(source, target, control)
        report = report.beside(change_of_maps(*both))
    spread = spread_over_grids(source, target, report.change)
    return replace(report, spread=spread)
