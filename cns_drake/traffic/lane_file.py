"""Reads and writes lane files: lanes and walkways without a `roads.yaml`."""

from collections.abc import Sequence
import json
import math
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import ConfigDict, Field

from cns_drake.base import (
    InputError,
    InputModel,
    parse_json,
    read_bytes,
    validated,
    value_errors,
)
from cns_drake.traffic import lane_graph
from cns_drake.traffic.lane_graph import LaneGraph, Piece, Walkway
from cns_drake.traffic.polylines import resampled

# Distance between the points of a lane in a file [m].
_FILE_SPACING = 1.0
# Limits of a file: greatest coordinate [m]; greatest number of lanes, and of
# phases of a signal.
_FARTHEST = 1e6
_MOST = 20_000
_MOST_PHASES = 8

_Coordinate = Annotated[float, Field(ge=-_FARTHEST, le=_FARTHEST)]
_Points = Annotated[
    list[tuple[_Coordinate, _Coordinate, _Coordinate]],
    Field(min_length=2, max_length=_MOST),
]


class _Model(InputModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class _Lane(_Model):
    points: _Points
    limit: float = Field(gt=0.0, le=100.0)
    way: bool
    after: list[Annotated[int, Field(ge=0)]]
    junction: int = Field(ge=0)
    left: int = Field(default=-1, ge=-1)
    right: int = Field(default=-1, ge=-1)
    phase: int = Field(default=-1, ge=-1, le=_MOST_PHASES - 1)


class _Crossing(_Model):
    line: _Points
    width: float = Field(gt=0.0, le=20.0)


class _Walkway(_Model):
    points: _Points
    half_width: float = Field(gt=0.0, le=10.0)
    start: int = Field(ge=0)
    end: int = Field(ge=0)
    crossing: int = Field(default=-1, ge=-1)


class _File(_Model):
    lanes: list[_Lane] = Field(min_length=1, max_length=_MOST)
    walkways: list[_Walkway] = Field(default=[], max_length=_MOST)
    crossings: list[_Crossing] = Field(default=[], max_length=_MOST)
    in_the_way: list[str] = Field(default=[], max_length=_MOST)


class LaneFile(NamedTuple):
    """The content of a lane file: lanes and walkways for traffic.

    Attributes:
        graph: the lanes and crossings.
        walkways: the walkways.
        in_the_way: names of structures, such as parked cars, that stand where
            vehicles drive. A drive with traffic leaves out these structures.
    """

    graph: LaneGraph
    walkways: list[Walkway]
    in_the_way: Sequence[str] = ()


def lane_text(
    graph: LaneGraph,
    walkways: Sequence[Walkway],
    in_the_way: Sequence[str] = (),
) -> str:
    """Returns the text of a lane file with the given content.

    The arguments are the fields of `cns_drake.traffic.lane_file.LaneFile`.
    """
    content: dict[str, Any] = {
        "lanes": [
            {
                "points": _thinned(piece.points),
                "limit": round(piece.limit, 3),
                "way": piece.is_way,
                "after": list(piece.after),
                "junction": piece.junction,
                **_numbers_except_none(piece, "left", "right", "phase"),
            }
            for piece in graph.pieces
        ],
        "walkways": [
            {
                "points": _thinned(way.points),
                "half_width": round(way.half_width, 3),
                "start": way.start,
                "end": way.end,
                **_numbers_except_none(way, "crossing"),
            }
            for way in walkways
        ],
    }
    if graph.crossings:
        content["crossings"] = [
            {
                "line": np.round(crossing.line, 3).tolist(),
                # The width of the rectangle around its line.
                "width": round(
                    crossing.area.area / math.dist(*crossing.line[:, :2]), 3
                ),
            }
            for crossing in graph.crossings
        ]
    if in_the_way:
        content["in_the_way"] = list(in_the_way)
    return json.dumps(content, separators=(",", ":")) + "\n"


def _numbers_except_none(
    stretch: Piece | Walkway, *names: str
) -> dict[str, int]:
    """Returns those of an object's named fields that are not -1."""
    values = {name: getattr(stretch, name) for name in names}
    return {name: value for name, value in values.items() if value != -1}


def read_lanes(path: Path) -> LaneFile:
    """Reads a lane file.

    Raises:
        InputError: the file cannot be read or is not a lane file.
    """
    with value_errors(f"{path}: not JSON"):
        found = validated(_File, parse_json(read_bytes(path)), path)
    _check_numbers(found, path)
    pieces = tuple(
        Piece(
            resampled(np.array(lane.points)),
            is_way=lane.way,
            after=tuple(lane.after),
            **lane.model_dump(exclude={"points", "way", "after"}),
        )
        for lane in found.lanes
    )
    walkways = [
        Walkway(
            resampled(np.array(way.points)),
            **way.model_dump(exclude={"points"}),
        )
        for way in found.walkways
    ]
    crossings = tuple(
        lane_graph.make_crossing(np.array(crossing.line), crossing.width)
        for crossing in found.crossings
    )
    return LaneFile(
        LaneGraph(pieces, crossings), walkways, tuple(found.in_the_way)
    )


def _check_numbers(found: _File, path: Path) -> None:
    """Checks that lanes, walkways and junctions have possible numbers.

    Args:
        found: content of a lane file.
        path: the file, for error messages.

    Raises:
        InputError: a number is impossible.
    """
    count = len(found.lanes)
    for k, lane in enumerate(found.lanes):
        wrong = [following for following in lane.after if following >= count]
        if wrong or not lane.after:
            raise InputError(
                f"{path}: lanes: {k}: after: "
                f"{wrong[0] if wrong else 'nothing'} is no lane"
            )
        for key in ("left", "right"):
            beside = getattr(lane, key)
            if beside >= count or (beside >= 0 and found.lanes[beside].way):
                raise InputError(
                    f"{path}: lanes: {k}: {key}: {beside} is no lane"
                )
    for k, walkway in enumerate(found.walkways):
        if walkway.crossing >= len(found.crossings):
            raise InputError(
                f"{path}: walkways: {k}: crossing: {walkway.crossing} is none"
            )
    if max(lane.junction for lane in found.lanes) >= _MOST:
        raise InputError(f"{path}: lanes: junction: at most {_MOST - 1}")


def _thinned(points: np.ndarray) -> list[list[float]]:
    return np.round(resampled(points, _FILE_SPACING), 3).tolist()
