"""Files of lanes and walkways, for maps without a `roads.yaml`."""

from __future__ import annotations

from collections.abc import Sequence
import json
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from cns_drake.base.errors import InputError, describe_validation_error
from cns_drake.base.files import read_bytes
from cns_drake.base.json_text import parse_json
from cns_drake.traffic.lane_graph import LaneGraph, Piece, resampled
from cns_drake.traffic.walkways import Walkway

# Between the points of a lane in a file [m].
_FILE_SPACING = 1.0
_FARTHEST = 1e6
_MOST = 20_000

_Coordinate = Annotated[float, Field(ge=-_FARTHEST, le=_FARTHEST)]
_Points = Annotated[
    list[tuple[_Coordinate, _Coordinate, _Coordinate]],
    Field(min_length=2, max_length=_MOST),
]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class _Lane(_Model):
    points: _Points
    limit: float = Field(gt=0.0, le=100.0)
    way: bool
    after: list[Annotated[int, Field(ge=0)]]
    junction: int = Field(ge=0)


class _Walkway(_Model):
    points: _Points
    half_width: float = Field(gt=0.0, le=10.0)
    start: int = Field(ge=0)
    end: int = Field(ge=0)


class _File(_Model):
    lanes: list[_Lane] = Field(min_length=1, max_length=_MOST)
    walkways: list[_Walkway] = Field(default=[], max_length=_MOST)


def lane_text(graph: LaneGraph, walkways: Sequence[Walkway]) -> str:
    """Returns the text of a file of lanes without signals and crossings."""
    content = {
        "lanes": [
            {
                "points": _thinned(piece.points),
                "limit": round(piece.limit, 3),
                "way": piece.is_way,
                "after": list(piece.after),
                "junction": piece.junction,
            }
            for piece in graph.pieces
        ],
        "walkways": [
            {
                "points": _thinned(way.points),
                "half_width": round(way.half_width, 3),
                "start": way.start,
                "end": way.end,
            }
            for way in walkways
        ],
    }
    return json.dumps(content, separators=(",", ":")) + "\n"


def read_lanes(path: Path) -> tuple[LaneGraph, list[Walkway]]:
    """Reads a text of `lane_text`.

    Raises:
        InputError: the file cannot be read or is not a file of lanes.
    """
    try:
        found = _File.model_validate(parse_json(read_bytes(path)))
    except ValidationError as error:
        raise InputError(
            describe_validation_error(path, error, _File)
        ) from None
    except ValueError as error:
        raise InputError(f"{path}: not JSON: {error}") from None
    for k, lane in enumerate(found.lanes):
        wrong = [one for one in lane.after if one >= len(found.lanes)]
        if wrong or not lane.after:
            raise InputError(
                f"{path}: lanes: {k}: after: "
                f"{wrong[0] if wrong else 'nothing'} is no lane"
            )
    pieces = tuple(
        Piece(
            resampled(np.array(lane.points)),
            lane.limit,
            lane.way,
            tuple(lane.after),
            junction=lane.junction,
        )
        for lane in found.lanes
    )
    count = 1 + max(piece.junction for piece in pieces)
    if count > _MOST:
        raise InputError(f"{path}: lanes: junction: at most {_MOST - 1}")
    walkways = [
        Walkway(
            resampled(np.array(way.points)), way.half_width, way.start, way.end
        )
        for way in found.walkways
    ]
    return LaneGraph(pieces, phases=(1,) * count), walkways


def _thinned(points: np.ndarray) -> list[list[float]]:
    return np.round(resampled(points, _FILE_SPACING), 3).tolist()
