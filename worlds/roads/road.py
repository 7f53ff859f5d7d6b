"""Roads with their centrelines and lanes, and the junctions that they join."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from evaluation.base import cos, sin
from worlds.roads.roads_file import RoadEntry
from worlds.shapes import DIRECTIONS, Centreline, Direction, sample_stations

End = Literal["start", "end"]
ENDS: tuple[End, End] = ("start", "end")


class Road:
    """A road between two junctions, which ends at the junctions' areas.

    The centreline is the middle of the carriageway, also if the road is one-way
    or has more lanes in one direction than in the other. Arc lengths
    ("stations") are measured along the whole centreline, from the position of
    the start junction; the road itself extends from `first_station` to
    `last_station`. Lateral offsets are positive to the left of the direction
    `forward`.
    """

    def __init__(
        self,
        name: str,
        entry: RoadEntry,
        curve: Centreline,
        setbacks: Sequence[float],
        heights: Sequence[float],
    ):
        """Makes a road between two junctions.

        Args:
            name: name of the road.
            entry: the road's fields in `roads.yaml`.
            curve: the whole centreline, from junction to junction.
            setbacks: distances of the road's two ends from the positions of
                their junctions [m].
            heights: heights of the two junctions [m].

        Raises:
            ValueError: the setbacks leave nothing of the road, or the heights
                in `entry` are outside the road or out of order.
        """
        self.name = name
        self.start = entry.start
        self.end = entry.end
        self.lanes = dict(zip(DIRECTIONS, entry.lanes, strict=True))
        self.lane_width = entry.lane_width
        self.median = entry.median
        self.parking = entry.parking
        self.sidewalk = entry.sidewalk
        self.kerb_height = entry.kerb_height
        self.speed_limit = entry.speed_limit
        self._curve = curve
        self.first_station = setbacks[0]
        self.last_station = curve.length - setbacks[1]
        if np.isinf(setbacks).any():
            raise ValueError(
                "it leaves a junction in the direction of another road; lead"
                " it elsewhere with via"
            )
        if self.length < 1.0:
            raise ValueError(
                f"its junctions need {sum(setbacks):.1f} m of its "
                f"{curve.length:.1f} m"
            )
        profile = [
            (0.0, heights[0]),
            (self.first_station, heights[0]),
            *entry.heights,
            (self.last_station, heights[1]),
            (curve.length, heights[1]),
        ]
        stations, z = np.transpose(profile)
        if np.any(np.diff(stations) <= 0):
            raise ValueError("heights must lie between the junctions, in order")
        # This import is slow, and not needed to describe or list drives.
        from scipy.interpolate import PchipInterpolator

        self._height = PchipInterpolator(stations, z)

    @property
    def length(self) -> float:
        """Length of the road between the areas of its junctions [m]."""
        return self.last_station - self.first_station

    @property
    def full_length(self) -> float:
        """Length of the whole centreline, from junction to junction [m]."""
        return self._curve.length

    @property
    def half_width(self) -> float:
        """Half the width of the carriageway, without parking bays [m]."""
        return (self.lane_width * sum(self.lanes.values()) + self.median) / 2

    def evaluate(
        self, stations: ArrayLike, offset: ArrayLike = 0.0
    ) -> np.ndarray:
        """Returns x, y, z [m] and heading of `forward` [rad] along a road.

        Args:
            stations: (N,) arc lengths along the whole centreline [m].
            offset: distance from the centreline, positive to the left, one for
                all stations or (N,) [m].

        Returns:
            (N, 4).
        """
        stations = np.asarray(stations, dtype=float)
        x, y, heading = self._curve.evaluate(stations).T
        x = x - offset * sin(heading)
        y = y + offset * cos(heading)
        return np.stack([x, y, self._height(stations), heading], axis=1)

    def height(self, stations: ArrayLike) -> np.ndarray:
        """Returns the heights (N,) at arc lengths along the centreline [m]."""
        return self._height(np.asarray(stations, dtype=float))

    def stations(
        self, spacing: float = 1.0, clearance: float = 0.0
    ) -> np.ndarray:
        """Returns evenly spaced stations (N,) between the junctions' areas [m].

        The stations are at most `spacing` apart. The first and the last station
        are `clearance` away from the ends of the road.
        """
        first = self.first_station + clearance
        last = self.last_station - clearance
        return sample_stations(first, last, spacing)

    def lane_offset(self, direction: Direction, lane: int) -> float:
        """Returns the distance of a lane's middle from the centreline [m].

        The distance is positive for a lane to the left of the centreline, as
        seen in the direction `forward`, and negative for a lane to the right.

        Raises:
            ValueError: the road has no such lane.
        """
        count = self.lanes[direction]
        if not 1 <= lane <= count:
            raise ValueError(
                f"road {self.name} has {count} lane(s) {direction}, "
                f"no lane {lane}"
            )
        # Offsets count from the kerb inwards: forward lanes are on the right.
        from_kerb = (count - lane + 0.5) * self.lane_width
        right = self.half_width - from_kerb
        return -right if direction == "forward" else right

    def lane_centreline(
        self, direction: Direction, lane: int, spacing: float = 1.0
    ) -> np.ndarray:
        """Returns the middle (N, 3) of a lane in driving direction [m].

        Args:
            direction: `forward` or `backward`.
            lane: number of the lane, from 1 next to the middle of the road.
            spacing: greatest distance between the points [m].
        """
        points = self.evaluate(
            self.stations(spacing), self.lane_offset(direction, lane)
        )[:, :3]
        return points if direction == "forward" else points[::-1]

    def lane_end(
        self, direction: Direction, lane: int, end: str
    ) -> tuple[float, float, float, float]:
        """Returns x, y, z [m] and the driving direction [rad] at a lane's end.

        `end` is "entry", where traffic enters the lane, or "exit", where it
        leaves the lane.
        """
        at_first = (direction == "forward") == (end == "entry")
        station = self.first_station if at_first else self.last_station
        offset = self.lane_offset(direction, lane)
        x, y, z, heading = self.evaluate([station], offset)[0]
        return x, y, z, heading if direction == "forward" else heading + np.pi


@dataclass(frozen=True)
class Arm:
    """One end of a road at a junction.

    Attributes:
        road: name of the road.
        end: which end of the road is at the junction.
        heading: direction of the road, away from the junction [rad].
        half_width: half the width of the carriageway [m].
        setback: distance from the junction's position to the end of the road
            [m].
    """

    road: str
    end: End
    heading: float
    half_width: float
    setback: float


@dataclass(frozen=True)
class Junction:
    """A junction of roads.

    Attributes:
        name: name of the junction.
        position: x and y of the point where the centrelines meet [m].
        height: height z of the junction [m].
        kerb_radius: radius of the kerb round each corner [m].
        arms: the ends of the junction's roads, in counter-clockwise order.
    """

    name: str
    position: tuple[float, float]
    height: float
    kerb_radius: float
    arms: tuple[Arm, ...]
