"""The fields of a `roads.yaml`, and its reader."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError

from cns_drake.base.errors import (
    InputError,
    describe_validation_error,
)
from cns_drake.base.yaml_files import read_yaml

# Largest coordinate of a town, and greatest width in it [m].
_LARGEST = 100_000.0
Finite = Annotated[float, Field(ge=-_LARGEST, le=_LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=_LARGEST, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, le=_LARGEST, allow_inf_nan=False)]
LaneCount = Annotated[int, Field(ge=0, le=4)]
# YAML has lists where the models have tuples; numbers stay strict.
Corner = Annotated[tuple[Finite, Finite, NonNegative], Strict(False)]
ProfilePoint = Annotated[tuple[Positive, Finite], Strict(False)]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class RoadStyle(_Model):
    """The common style of a town's roads; every road may override it.

    Attributes:
        lanes: lanes along the centreline and against it, up to 4 each; a zero
            makes the road one-way.
        lane_width: width of a lane [m].
        median: width of the kerbed strip between the directions [m].
        parking: width of the bays cut into both sidewalks, 0 for none [m].
        sidewalk: width of the sidewalk on each side [m].
        kerb_height: height of sidewalks and medians above the lanes [m].
        speed_limit: speed limit [m/s].
    """

    lanes: tuple[LaneCount, LaneCount] = Field(default=(1, 1), strict=False)
    lane_width: Positive = 3.5
    median: NonNegative = 0.0
    parking: NonNegative = 0.0
    sidewalk: NonNegative = 2.0
    kerb_height: NonNegative = 0.15
    speed_limit: Positive = 13.9


class RoadEntry(RoadStyle):
    """One road between two junctions.

    Attributes:
        start: name of the junction where the centreline begins.
        end: name of the junction where it ends.
        via: corners on the way, each `[x, y, radius of its bend]` [m].
        heights: points between the junctions, each `[distance along the
            centreline, height]` [m]; in between the height follows a monotone
            cubic, and it is level where the road meets a junction.
        start_setback: how far from the junction's position the road begins [m];
            by default it follows from the kerb radius.
        end_setback: likewise at its end [m].
    """

    start: str
    end: str
    via: tuple[Corner, ...] = Field(default=(), strict=False)
    heights: tuple[ProfilePoint, ...] = Field(default=(), strict=False)
    start_setback: Positive | None = None
    end_setback: Positive | None = None


class JunctionEntry(_Model):
    """A junction of roads; also the joint of two different roads.

    Attributes:
        position: `[x, y]` where the centrelines meet [m].
        height: the junction's area is level at this z [m].
        kerb_radius: radius of the kerb round each corner; of a dead end, radius
            of the disc in which its road ends [m].
        dead_end: only one road comes here, and traffic cannot go on.
    """

    position: tuple[Finite, Finite] = Field(strict=False)
    height: Finite = 0.0
    kerb_radius: Positive = 8.0
    dead_end: bool = False


class RoadsFile(_Model):
    """The whole file: styles, junctions by name and roads by name.

    Attributes:
        defaults: style of roads without their own.
        junctions: name -> junction, at least one.
        roads: name -> road, at least one.
    """

    defaults: RoadStyle = RoadStyle()
    junctions: dict[str, JunctionEntry] = Field(min_length=1)
    roads: dict[str, RoadEntry] = Field(min_length=1)


def read_roads_file(path: Path | str) -> RoadsFile:
    """Reads and validates a `roads.yaml`.

    Raises:
        InputError: the file cannot be read, is not YAML, or has an unknown
            key, a missing one or a value of the wrong type.
    """
    path = Path(path)
    content = read_yaml(path)
    try:
        return RoadsFile.model_validate(_with_defaults(content))
    except ValidationError as error:
        raise InputError(
            describe_validation_error(path, error, RoadsFile)
        ) from error


def _with_defaults(content: Any) -> Any:
    """Gives each road the file's defaults, leaving faults to validation."""
    if not isinstance(content, dict):
        return content
    defaults, roads = content.get("defaults"), content.get("roads")
    if not isinstance(defaults, dict) or not isinstance(roads, dict):
        return content
    known = defaults.keys() & RoadStyle.model_fields.keys()
    shared = {key: defaults[key] for key in known}
    merged = {
        name: {**shared, **road} if isinstance(road, dict) else road
        for name, road in roads.items()
    }
    return {**content, "roads": merged}
