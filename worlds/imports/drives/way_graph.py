"""A graph of pieces, such as lanes, from which the path of a car is built."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
import math

import numpy as np
from scipy.sparse import coo_array, csr_array

from evaluation.base import arctan2, cos, sin
from worlds.imports.drives.steerable_drives import Obstacle, WaypointRoute

# Greatest share by which lengths are made unequal.
_UNEQUAL = 0.04
# A turn from the directions of a grid to one that none of its streets has, and
# that is not in the middle between two [rad].
_ASIDE = 0.4
# Numbers of directions that streets may prefer: those of a grid, of a honeycomb
# or triangles, of rings.
_FOLDS = range(4, 65, 2)
# A network prefers directions if this share of its length remains in their mean
# [-]. Coordinates in centimetres leave less where it has none.
_PREFERRED = 1e-3
# Scores of views that differ by less than this share are equal.
_EQUAL = 1e-6
# Lengths are whole numbers of this step [m]: sums are exact, in any order.
_STEP = 2.0**-20


def _growth(lengths: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Returns a number (N,) from 0 to 1 for each piece, from where it is.

    It grows in directions that depend only on the form of the network: not on
    its place, its turn, or the order of its pieces. A network that looks the
    same when it is turned has several such directions; its ways are the same in
    each of them, turned.

    Args:
        lengths: (N,) lengths of pieces [m].
        ends: (N, 2, 2) where each piece begins, and ends [m].
    """
    begins, ends = np.moveaxis(ends, 1, 0)
    steps = ends - begins
    weights = lengths / lengths.sum()
    # Another place for each direction of a street.
    places = begins + steps / 3.0
    places -= (weights[:, None] * (begins + steps / 2.0)).sum(axis=0)
    places /= max(np.sqrt((places**2).sum(axis=1).max()), 1.0)
    fold, turn = _grid(steps)
    turns = turn + 2.0 * np.pi / fold * np.arange(fold)
    views = [_turned(places, -angle) for angle in turns.tolist()]
    scores = [_score(weights, view, fold) for view in views]
    # Of directions in which the network looks the same, the one that is the
    # nearest to a fixed direction.
    best = max(
        (k for k in range(fold) if scores[k] > max(scores) - _EQUAL),
        key=lambda k: math.cos(turns[k] - _ASIDE),
    )
    along = _turned(views[best], -_ASIDE)[:, 0]
    x, y = _turned(views[best], -1.5 * _ASIDE).T
    # The square is there for streets that enclose equal areas.
    growth = along + 0.1 * (x * x - y * y)
    return np.asarray(0.5 + growth / 2.2)


def _grid(steps: np.ndarray) -> tuple[int, float]:
    """Returns how many directions steps (N, 2) prefer, and one of them [rad].

    The same for a street, its opposite direction, and its cross streets.
    """
    heading = arctan2(steps[:, 1], steps[:, 0])
    sizes = np.sqrt((steps**2).sum(axis=1))
    for fold in _FOLDS:
        x = float((sizes * cos(fold * heading)).sum())
        y = float((sizes * sin(fold * heading)).sum())
        if math.hypot(x, y) > _PREFERRED * sizes.sum():
            return fold, math.atan2(y, x) / fold
    return _FOLDS[0], 0.0


def _turned(xy: np.ndarray, angle: float) -> np.ndarray:
    """Returns places (N, 2), turned by an angle [rad] about the origin."""
    c, s = math.cos(angle), math.sin(angle)
    x, y = xy.T
    return np.column_stack([c * x - s * y, s * x + c * y])


def _score(weights: np.ndarray, view: np.ndarray, fold: int) -> float:
    """Returns a number for places (N, 2) that differs if they are turned.

    It is the mean of z^2 + z^3 + ... + z^fold in complex numbers, seen from
    aside. If it is the same in two of `fold` directions, the places are.
    """
    x, y = px, py = view.T
    along = across = 0.0
    for _ in range(2, fold + 1):
        px, py = px * x - py * y, px * y + py * x
        along += float((weights * px).sum())
        across += float((weights * py).sum())
    return along * math.cos(_ASIDE) + across * math.sin(_ASIDE)


class WayGraph(ABC):
    """A graph of N pieces, from which the paths of a car can be built.

    A piece is, for example, a lane from one junction to the next. A sequence of
    pieces is called a way. An edge of the graph leads from a piece to each
    piece that can follow it.

    A grid of streets has many ways of one length, between which the last bit of
    coordinates would decide. Where the ends of pieces are known, lengths are
    therefore made unequal, and whole numbers of micrometres.

    Attributes:
        lengths: (N,) lengths of the pieces [m], longer by up to 4 %.
        order: (N,) the pieces in an order that does not depend on the file.
        is_open: (N,) whether a car can drive along a piece, as far as is known.
    """

    def __init__(
        self,
        lengths: np.ndarray,
        before: np.ndarray,
        after: np.ndarray,
        costs: np.ndarray | None = None,
        ends: np.ndarray | None = None,
    ):
        """Links pieces: `before[k]` leads into `after[k]`, for L links.

        `lengths` (N,) contains the lengths of the pieces [m]. `costs` (L,)
        contains the cost of each link, from the middle of a piece to the middle
        of the next piece. If `costs` is None, each cost is the length of the
        link [m]. `ends` (N, 2, 2) contains where pieces begin and end [m].
        """
        self.order = np.arange(len(lengths))
        if ends is not None and len(ends):
            growth = _growth(lengths, ends)
            lengths = lengths * (1.0 + _UNEQUAL * growth)
            lengths = np.rint(lengths / _STEP) * _STEP
            self.order = np.argsort(np.round(growth, 9), kind="stable")
        self.lengths = lengths
        if costs is None:
            costs = (lengths[before] + lengths[after]) / 2.0
        self._before, self._after, self._costs = before, after, costs
        self.is_open = np.ones(len(lengths), dtype=bool)

    @abstractmethod
    def beside(self, pieces: np.ndarray, joint: int) -> np.ndarray:
        """Returns (N,) bool: pieces that an arm of the second drive must avoid.

        An arm is the part of the second drive before it joins the first drive,
        or the part after it has left the first drive. Pieces to avoid are the
        pieces of the drives so far, and pieces close to those pieces.

        Args:
            pieces: numbers of the pieces of the drives so far.
            joint: piece at which the second drive joins or leaves the first
                drive; this piece is allowed.
        """

    @abstractmethod
    def is_simple(self, way: Sequence[int]) -> bool:
        """Returns whether a way visits no place twice.

        `way` is a sequence of piece numbers.
        """

    @abstractmethod
    def drive(self, way: Sequence[int]) -> WaypointRoute | Obstacle:
        """Returns the drive along a way, or the place (2,) of its failure [m].

        A drive fails at an obstacle or a bend that is too tight, see
        `steerable_drive`. `way` is a sequence of piece numbers.
        """

    @abstractmethod
    def blocked(self, way: Sequence[int], place: Obstacle) -> np.ndarray:
        """Returns the pieces of a way that an obstacle blocks.

        `way` is a sequence of piece numbers, and `place` (2,) the place of the
        obstacle [m].
        """

    def along(self, way: Sequence[int]) -> np.ndarray:
        """Returns the distance (N,) along a way to each piece's end [m]."""
        return np.cumsum(self.lengths[list(way)])

    def length(self, way: Sequence[int]) -> float:
        """Returns the length of a way [m]; 0 if the way has no pieces."""
        return float(self.along(way)[-1]) if len(way) else 0.0

    def cut(self, way: list[int], longest: float) -> list[int]:
        """Returns the beginning of a way, as a list of piece numbers.

        The result contains as many pieces as fit into `longest` [m] together,
        but at least one.
        """
        kept = int(np.searchsorted(self.along(way), longest, "right"))
        return way[: max(1, kept)]

    def links(self, closed: np.ndarray | None = None) -> csr_array:
        """Returns the costs from piece to next piece, a sparse matrix (N, N).

        By default, a cost is the length of the way between the pieces' middles
        [m]. Pieces that are not open, and pieces in the mask `closed` (N,),
        have no edges.
        """
        is_open = self.is_open if closed is None else self.is_open & ~closed
        kept = is_open[self._before] & is_open[self._after]
        size = (len(self.lengths), len(self.lengths))
        pairs = (self._before[kept], self._after[kept])
        return coo_array((self._costs[kept], pairs), size).tocsr()
