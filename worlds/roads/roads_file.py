"""The file `roads.yaml`: junctions and roads of a town, and their style."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, Strict

from evaluation.base import read_yaml, validated

# Greatest coordinate in a town, and greatest width [m].
_LARGEST = 100_000.0
Finite = Annotated[float, Field(ge=-_LARGEST, le=_LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=_LARGEST, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, le=_LARGEST, allow_inf_nan=False)]
LaneCount = Annotated[int, Field(ge=0, le=4)]
# YAML has lists instead of tuples, so the tuple is not strict; its numbers are.
Corner = Annotated[tuple[Finite, Finite, NonNegative], Strict(False)]
ProfilePoint = Annotated[tuple[Positive, Finite], Strict(False)]
# Part of the names of mesh files, so it must not lead to another folder.
MeshStem = Annotated[str, Field(pattern=r"^[^/<>&\x00-\x1f\x7f]+$")]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class RoadStyle(_Model):
    """The style of a road.

    The field `defaults` of the file sets the following fields for all roads. A
    road that sets one of these fields itself overrides the default.

    Attributes:
        lanes: numbers of lanes in the direction of the road's centreline and
            against this direction, each from 0 to 4. A zero makes the road
            one-way.
        lane_width: width of a lane [m].
        median: width of the kerbed strip between the two directions [m]; 0 for
            none.
        parking: width of the parking bays that are cut into the sidewalks on
            both sides [m]; 0 for none.
        sidewalk: width of the sidewalk on each side [m].
        kerb_height: height of sidewalks and medians above the carriageway [m].
        speed_limit: speed limit of the road [m/s].
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
        start: name of the junction at which the road's centreline starts.
        end: name of the junction at which the road's centreline ends.
        via: corners of the centreline between the junctions, each as `[x, y,
            radius of the bend]` [m].
        heights: heights between the junctions, each as `[distance along the
            centreline, height]` [m]. A monotone cubic curve joins them, level
            at the junctions.
        start_setback: distance from the position of the first junction to the
            start of the road [m]. By default this distance follows from the
            kerb radius.
        end_setback: distance from the end of the road to the position of the
            last junction [m]. By default this distance follows from the kerb
            radius.
    """

    start: str
    end: str
    via: tuple[Corner, ...] = Field(default=(), strict=False)
    heights: tuple[ProfilePoint, ...] = Field(default=(), strict=False)
    start_setback: Positive | None = None
    end_setback: Positive | None = None


class JunctionEntry(_Model):
    """A junction of roads, or the joint between two roads that differ.

    Attributes:
        position: `[x, y]` of the point where the centrelines meet [m].
        height: height z of the junction [m]. The whole area of the junction is
            level.
        kerb_radius: radius of the kerb round each corner [m]; at a dead end,
            the radius of the disc in which the road ends.
        dead_end: whether the junction is a dead end: the end of its only road,
            where traffic cannot go on.
    """

    position: tuple[Finite, Finite] = Field(strict=False)
    height: Finite = 0.0
    kerb_radius: Positive = 8.0
    dead_end: bool = False


class RoadsFile(_Model):
    """The file `roads.yaml`: junctions, roads, and a style for all roads.

    Attributes:
        defaults: style of all roads, from which a road takes all fields that it
            does not set.
        junctions: junctions by name, at least one.
        roads: roads by name, at least one.
    """

    defaults: RoadStyle = RoadStyle()
    junctions: dict[MeshStem, JunctionEntry] = Field(min_length=1)
    roads: dict[MeshStem, RoadEntry] = Field(min_length=1)


def read_roads_file(path: Path | str) -> RoadsFile:
    """Returns the validated content of a `roads.yaml`.

    Raises:
        InputError: the file cannot be read, is not YAML, or has an unknown key,
            a missing key or a value of the wrong type.
    """
    path = Path(path)
    return validated(RoadsFile, _with_defaults(read_yaml(path)), path)


def _with_defaults(content: Any) -> Any:
    """Returns a file's content with its defaults copied to each road.

    The content is not checked here: faults stay in it until the validation.
    """
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
