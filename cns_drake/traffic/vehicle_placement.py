"""Where vehicles begin: at random places in lanes."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cns_drake.traffic.lane_graph import LaneGraph
from cns_drake.traffic.streets import Streets, is_ego_far
from cns_drake.traffic.vehicle_kinds import KINDS, VehicleKind
from cns_drake.traffic.vehicle_records import CURRENT, VEHICLE

# At the start, a vehicle needs this length of lane in addition to its own [m].
_SPACE = 9.0
# At the start, a vehicle drives at this share of the allowed speed.
_PART_OF_SPEED = 0.5
# Greatest braking that a vehicle needs at the start [m/s^2].
_FIRST_BRAKING = 0.75
# Drivers' wanted speeds differ from those of their kind by up to this share.
_FACTOR_SPREAD = 0.1
# Least distance of a vehicle's ends from the ends of its lane at the start [m].
_FROM_ENDS = 1.0
# Number of random places that are tried for a vehicle.
_TRIES = 200


def room_for_vehicles(graph: LaneGraph) -> int:
    """Returns the number of vehicles that can move in the lanes of a graph."""
    mean = sum(kind.share * kind.size[0] for kind in KINDS)
    mean /= sum(kind.share for kind in KINDS)
    return int(
        sum(graph.pieces[k].length // (mean + 2 * _SPACE) for k in graph.lanes)
    )


def place_vehicles(
    kinds: Sequence[VehicleKind], streets: Streets, rng: np.random.Generator
) -> tuple[np.ndarray, list[int]]:
    """Places vehicles in lanes at random, away from the ego car's first place.

    Args:
        kinds: kind of each vehicle.
        streets: arrays of all lanes, with the ego car.
        rng: the random generator.

    Returns:
        Records of dtype `VEHICLE` of the vehicles for which a place was found;
        and the index of each of these vehicles in `kinds`.
    """
    places = _draw_places(kinds, streets, rng)
    found = [place.number for place in places]
    cars = np.zeros(len(found), VEHICLE)
    for name in ("held", "left_lane", "path"):
        cars[name] = -1
    cars["since"], cars["change_length"] = np.inf, 1.0
    cars["path"][:, CURRENT] = [place.lane for place in places]
    cars["s"] = [place.s for place in places]
    for car, kind in zip(cars, (kinds[k] for k in found), strict=True):
        car["length"], car["large"] = kind.size[0], kind.is_large
        car["rear_axle"], car["front_axle"] = kind.axles
        car["top"], car["factor"] = kind.top_speed, kind.speed_factor
        car["a"], car["b"] = kind.acceleration, kind.deceleration
        car["headway"] = kind.headway
    cars["factor"] *= rng.uniform(
        1.0 - _FACTOR_SPREAD, 1.0 + _FACTOR_SPREAD, len(cars)
    )
    cars["v"] = _first_speeds(streets, cars)
    return cars, found


class _Place(NamedTuple):
    """Where a vehicle begins.

    Attributes:
        number: number of the vehicle.
        lane: number of the lane's piece.
        s: place of the front bumper on the lane [m].
    """

    number: int
    lane: int
    s: float


def _draw_places(
    kinds: Sequence[VehicleKind], streets: Streets, rng: np.random.Generator
) -> list[_Place]:
    """Returns the random places of vehicles; some may find none.

    For the arguments, see `place_vehicles`.
    """
    free = np.flatnonzero(~streets.pieces["is_way"])
    lengths = streets.pieces["length"]
    share = lengths[free] / lengths[free].sum()
    # Lane -> the spans in it that vehicles need [m].
    taken: dict[int, list[tuple[float, float]]] = {}
    places = []
    for number, kind in enumerate(kinds):
        for _ in range(_TRIES):
            lane = int(rng.choice(free, p=share))
            low = kind.size[0] + _FROM_ENDS
            if lengths[lane] < low + _FROM_ENDS:
                continue
            s = float(rng.uniform(low, lengths[lane] - _FROM_ENDS))
            start, end = s - kind.size[0] - _SPACE / 2, s + _SPACE / 2
            if any(start < b and a < end for a, b in taken.get(lane, [])):
                continue
            if streets.until[0, lane] == 0.0 or not is_ego_far(
                streets, 0, lane, s
            ):
                continue
            taken.setdefault(lane, []).append((start, end))
            places.append(_Place(number, lane, s))
            break
    return places


def _first_speeds(streets: Streets, cars: np.ndarray) -> np.ndarray:
    """Returns the speeds (N,) at which vehicles begin [m/s].

    They can stop before the line, or behind the vehicle ahead.

    Args:
        streets: arrays of all lanes.
        cars: (N,) records of dtype `VEHICLE`, with all but the speed.
    """
    lanes = streets.pieces[cars["path"][:, CURRENT]]
    points = lanes["first"] + (cars["s"] / lanes["step"]).astype(int)
    allowed = streets.speed[points]
    v = _PART_OF_SPEED * np.minimum(cars["top"], cars["factor"] * allowed)
    left = np.minimum(lanes["length"] - cars["s"], _SPACE / 2)
    return np.minimum(v, np.sqrt(2.0 * _FIRST_BRAKING * left))
