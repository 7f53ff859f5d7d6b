"""Vehicles and crossings as records, while traffic is simulated."""

from typing import NamedTuple

import numpy as np

from cns_drake.traffic.lane_graph import LaneGraph
from cns_drake.traffic.streets import Streets

# Column of a vehicle's path with the piece of its front bumper. The columns
# before it are for the rear, and the columns behind it are for pieces ahead.
CURRENT = 5
NUM_PIECES = 8
# Greatest number of pieces that one vehicle is on.
_MOST_ENTRIES = 8

# A vehicle as a record: its constants and its present state.
VEHICLE = np.dtype(
    [
        ("length", float),  # [m]
        ("rear_axle", float),  # x from the middle [m].
        ("front_axle", float),
        ("factor", float),  # Wanted share of the allowed speed.
        ("top", float),  # Greatest speed [m/s].
        ("a", float),  # Car-following model: a, b, headway.
        ("b", float),
        ("headway", float),
        ("guided", bool),  # Whether it is the ego car, which `Follower` moves.
        ("large", bool),  # Whether it leaves its lane in turns.
        ("path", int, NUM_PIECES),  # Pieces, -1 for none.
        ("s", float),  # The front bumper's place on the current piece [m].
        ("v", float),  # Speed [m/s].
        ("granted", bool),  # Whether it may leave its lane.
        ("held", int),  # The way that is kept free for it; -1 for none.
        ("order", int),  # Order among vehicles with a way: lowest first.
        ("since", float),  # When it began to wait for its way; inf: never [s].
        ("refused", float),  # Time without room beyond its way [s].
        ("left_lane", int),  # The lane that it is leaving; -1 for none.
        ("change_start", float),  # Where a lane change begins, on the lane [m].
        ("change_length", float),
        ("draws", int),  # Count of the random numbers it has drawn.
    ],
    align=True,
)
# An entry in the list of vehicles on a piece: the part of a vehicle on this
# piece.
_ENTRY = np.dtype(
    [
        ("after", int),  # The next entry on the piece; -1 for none.
        ("who", int),  # Number of a vehicle, or `occupants.EGO`.
        ("rear", float),  # Along the piece [m].
        ("front", float),
        ("speed", float),  # [m/s]
    ]
)
# A crossing as a record, with the pedestrians on it.
CROSSING = np.dtype(
    [
        ("waits", float),  # When pedestrians began to wait; inf: none [s].
        ("opened", float),  # Time at which it was last opened [s].
        ("closed", float),  # Time at which it was last left [s].
        ("start", float, 2),  # Where its line begins [m].
        ("along", float, 2),  # Unit vector along it.
        ("length", float),  # [m]
        ("users", int),  # Number of pedestrians with permission.
        ("order", int),  # As in `VEHICLE`; 0 while no pedestrians ask.
        ("is_open", bool),  # Whether pedestrians are on it.
        ("marked", bool),  # See `Crossing`.
        # Pedestrians who go to the end, and to the beginning, of its line have
        # yet to walk beyond these places [m].
        ("to_end", float),
        ("to_start", float),
    ]
)


class Traffic(NamedTuple):
    """Vehicles and crossings while they are simulated.

    Attributes:
        streets: arrays of the P pieces of lanes and junction paths.
        cars: (N,) records of dtype `VEHICLE`.
        crossings: (C,) records of dtype `CROSSING`.
        seed: seed of the random directions at junctions.
        head: (P,) number of the first entry in the list of vehicles on each
            piece; -1 for an empty list.
        entries: the entries of all these lists; each contains the number of the
            next entry. `occupants.find_occupants` fills the lists.
    """

    streets: Streets
    cars: np.ndarray
    crossings: np.ndarray
    seed: int
    head: np.ndarray
    entries: np.ndarray


def begin_traffic(
    streets: Streets, cars: np.ndarray, crossings: np.ndarray, seed: int
) -> Traffic:
    """Returns the traffic at the start of a simulation.

    Args:
        streets: arrays of all lanes.
        cars: (N,) records of dtype `VEHICLE`.
        crossings: (C,) records of dtype `CROSSING`.
        seed: seed of the random directions at junctions.
    """
    num_pieces = len(streets.pieces)
    entries = np.zeros(_MOST_ENTRIES * len(cars) + num_pieces, _ENTRY)
    head = np.full(num_pieces, -1)
    return Traffic(streets, cars, crossings, seed, head, entries)


def make_crossings(graph: LaneGraph) -> np.ndarray:
    """Returns the crossings of a lane graph, (C,) of dtype `CROSSING`.

    No pedestrians are on them yet.
    """
    crossings = np.zeros(len(graph.crossings), CROSSING)
    crossings["waits"] = np.inf
    crossings["opened"] = crossings["closed"] = -np.inf
    crossings["to_end"], crossings["to_start"] = -np.inf, np.inf
    for row, crossing in zip(crossings, graph.crossings, strict=True):
        start, end = crossing.line[[0, -1], :2]
        x, y = end - start
        row["length"] = np.sqrt(x * x + y * y)
        row["start"], row["along"] = start, (end - start) / row["length"]
        row["marked"] = crossing.marked
    return crossings
