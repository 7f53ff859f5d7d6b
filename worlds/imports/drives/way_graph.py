"""A graph of pieces, such as lanes, from which the path of a car is built."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array, csr_array

from worlds.imports.drives.steerable_drives import Obstacle, WaypointRoute

# Greatest share by which lengths are made unequal.
_UNEQUAL = 0.04
# A turn from the directions of a grid to one that none of its streets has, and
# that is not in the middle between two [rad].
_ASIDE = 0.4


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
    begins, ends = np.moveaxis(ends[:, :, 0] + 1j * ends[:, :, 1], 1, 0)
    steps = ends - begins
    # Another place for each direction of a street.
    places = begins + steps / 3.0
    places -= np.average(begins + steps / 2.0, weights=lengths)
    # The same for a street, its opposite direction, and its cross streets.
    grid = np.sum(np.abs(steps) * np.exp(4j * np.angle(steps)))
    places *= np.exp(-0.25j * np.angle(grid)) / max(np.abs(places).max(), 1.0)
    aside = np.exp(-1j * _ASIDE)
    view = max(
        (places * 1j**quarters for quarters in range(4)),
        key=lambda z: float((lengths @ (z**2 + z**3) * aside).real),
    )
    # The square is there for streets that enclose equal areas.
    growth = (view * aside + 0.1 * view**2 * aside**3).real
    return np.asarray(0.5 + growth / 2.2)


class WayGraph(ABC):
    """A graph of N pieces, from which the paths of a car can be built.

    A piece is, for example, a lane from one junction to the next. A sequence of
    pieces is called a way. An edge of the graph leads from a piece to each
    piece that can follow it.

    A grid of streets has many ways of one length, between which the last bit of
    coordinates would decide. Where the ends of pieces are known, lengths are
    therefore made unequal.

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
            self.order = np.argsort(growth)
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
