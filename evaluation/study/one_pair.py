"""The two tables of one method on one pair of drives."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cns_drake.base.drives.drive import Drive
from cns_drake.base.errors import one_line
from evaluation.recognition.place_outcome import (
    PlaceOutcome,
    place_numbers,
    pose_numbers,
)
from evaluation.recognition.place_recognition import PlaceRecognition
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
    result: PlaceRecognition,
    query: Drive,
    settings: Mapping[str, Any],
    sensor_height: float | None = None,
) -> tuple[Results, QueryRows]:
    """Returns a result as tables, in the same form as those of studies.

    Args:
        result: the result.
        query: the drive of the queries.
        settings: name -> value of the settings of the method that were given.
        sensor_height: height of the LiDAR [m]; None for the methods' default.
    """
    found = result.retrieval
    frames = found.query_frames
    outcome = PlaceOutcome.of(
        result.method,
        result.protocol.gate,
        found,
        (query.stamps_ns[frames], query.X_WS[frames, :3, 3]),
        [result.database] * len(found.database_frames),
        np.full(len(frames), np.nan),
        result.protocol.radius,
    )
    height = {} if sensor_height is None else {"sensor_height": sensor_height}
    key: dict[str, Any] = {
        "experiment": _EXPERIMENT,
        "map": _map_of(query),
        "database": result.database,
        "query": result.query,
        "seed": result.asked.seed,
        "factors": {
            f"{SETTINGS}{result.method}.{name}": value
            for name, value in settings.items()
        },
        "method": result.method,
        "gate": result.protocol.gate,
        **made_by(result.asked, height),
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
