"""How vehicles spread over a lane graph, if each takes random directions."""

import numpy as np

from cns_drake.traffic.lane_graph import LaneGraph

# Number of steps of a vehicle that takes random ways.
_WANDERS = 200
# For each driver who turns, this many go straight on.
_STRAIGHT_SHARE = 3.0
# For each driver who turns, this many turn round.
_TURN_ROUND_SHARE = 0.02
# Cosine of the angle between straight on and a turn; its negative lies between
# a turn and turning round.
_TURN_COSINE = 0.7


def way_shares(graph: LaneGraph, piece: int) -> np.ndarray:
    """Returns how drivers divide among the pieces that follow a piece.

    Args:
        graph: the lane graph.
        piece: number of the piece.

    Returns:
        Share of the drivers on each piece in `graph.pieces[piece].after`; the
        sum is 1.
    """
    after = graph.pieces[piece].after
    likes = []
    for k in after:
        steps = np.diff(graph.pieces[k].points[:, :2], axis=0)[[0, -1]]
        a, b = steps / np.linalg.norm(steps, axis=1)[:, None]
        turn = a @ b
        likes.append(
            _STRAIGHT_SHARE
            if turn > _TURN_COSINE
            else 1.0
            if turn > -_TURN_COSINE
            else _TURN_ROUND_SHARE
        )
    return np.array(likes) / sum(likes)


def flows(graph: LaneGraph) -> np.ndarray:
    """Returns each piece's share (P,) of all passes of vehicles over pieces.

    Vehicles start on all pieces in equal numbers, and choose each next piece
    with the shares of `way_shares`. The share of a piece does not depend on the
    piece's length.
    """
    pieces = graph.pieces
    step = np.zeros((len(pieces), len(pieces)))
    for k, piece in enumerate(pieces):
        step[k, list(piece.after)] = way_shares(graph, k)
    flow = np.full(len(pieces), 1.0 / len(pieces))
    mean = np.zeros(len(pieces))
    for _ in range(_WANDERS):
        flow = flow @ step
        mean += flow / _WANDERS
    return mean
