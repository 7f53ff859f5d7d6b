"""The two tables of one method on one pair of drives."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cns_drake.base.drives.drive import Drive
from cns_drake.base.errors import one_line
from evaluation.recognition.place_outcome import (
    PlaceOutcome,
    place_numbers,
    pose_numbers,
)
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.results.table import (
    SETTINGS,
    Answers,
    QueryRows,
    Results,
    Row,
    made_by,
)

# Name of the experiment in tables of a single pair.
_EXPERIMENT = "pr"


def pair_tables(
    outcome: PlaceOutcome,
    query: Drive,
    protocol: RetrievalProtocol,
    settings: Mapping[str, Any],
    sensor_height: float | None = None,
) -> tuple[Results, QueryRows]:
    """Returns an outcome as tables, in the same form as those of studies.

    Args:
        outcome: the outcome.
        query: the drive of the queries.
        protocol: the protocol that was asked for.
        settings: name -> value of the settings of the method that were given.
        sensor_height: height of the LiDAR [m]; None for the methods' default.
    """
    height = {} if sensor_height is None else {"sensor_height": sensor_height}
    key: dict[str, Any] = {
        "experiment": _EXPERIMENT,
        "map": _map_of(query),
        "database": outcome.database,
        "query": outcome.query,
        "seed": protocol.seed,
        "factors": {
            f"{SETTINGS}{outcome.method}.{name}": value
            for name, value in settings.items()
        },
        "method": outcome.method,
        "gate": outcome.is_gated,
        **made_by(protocol, height),
    }
    rows = [
        Row.of(number, **key, task=task)
        for task, numbers in (("place", place_numbers), ("pose", pose_numbers))
        for number in numbers(outcome, None)
    ]
    answers = Answers(**key, task="place", columns=outcome.columns)
    return Results.of(rows), QueryRows.of([answers])


def _map_of(drive: Drive) -> str:
    """Returns the name of a drive's map, or else of its world frame."""
    named = (drive.scenario or {}).get("map")
    if named is not None:
        return one_line(Path(str(named)).name)
    return drive.world_frame.partition("/")[0] or drive.name
