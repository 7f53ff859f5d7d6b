"""Lanes of roads by their names, and routes along them."""

from typing import Annotated, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, RootModel, Strict

Direction = Literal["forward", "backward"]
DIRECTIONS: tuple[Direction, Direction] = ("forward", "backward")


class LaneRef(NamedTuple):
    """Identifies a lane of a road network.

    Attributes:
        road: name of the road.
        direction: driving direction of the lane: `forward` along the road's
            centreline, or `backward` against it.
        lane: number of the lane, from 1 next to the middle of the road.
    """

    road: str
    direction: Direction
    lane: int


LaneNumber = Annotated[int, Field(ge=1)]
LaneChange = Annotated[tuple[LaneNumber, LaneNumber], Strict(False)]


class RouteLeg(BaseModel):
    """One leg of a route: a road and the lane to follow on it.

    Attributes:
        road: name of the road.
        direction: direction of travel: `forward` along the road's centreline,
            or `backward` against it.
        lane: number of the lane, counted from 1 next to the middle of the road.
            Two numbers, such as `[1, 2]`, make the car change from the first
            lane to the second.
        start: where the drive starts: the distance from the point where the
            first leg enters its road [m]. Only in the first leg.
        end: where the drive ends, or where the car turns round: the distance
            from the point where the leg enters the road [m]. Allowed only
            in the last leg, and in a leg that ends with a turn on the same
            road.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    road: str
    direction: Direction
    lane: LaneNumber | LaneChange
    start: float | None = Field(default=None, ge=0, allow_inf_nan=False)
    end: float | None = Field(default=None, gt=0, allow_inf_nan=False)

    @property
    def entry_lane(self) -> LaneRef:
        """The lane on which the leg begins."""
        lane = self.lane if isinstance(self.lane, int) else self.lane[0]
        return LaneRef(self.road, self.direction, lane)

    @property
    def exit_lane(self) -> LaneRef:
        """The lane on which the leg ends."""
        lane = self.lane if isinstance(self.lane, int) else self.lane[1]
        return LaneRef(self.road, self.direction, lane)


class Route(RootModel[list[RouteLeg]]):
    """The legs of a drive along lanes, in order."""

    root: list[RouteLeg] = Field(min_length=1)
