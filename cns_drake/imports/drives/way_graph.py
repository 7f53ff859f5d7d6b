"""A graph of pieces, such as lanes, from which the path of a car is built."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array, csr_array

from cns_drake.imports.drives.steerable_drives import Obstacle, WaypointRoute


class WayGraph(ABC):
    """A graph of N pieces, from which the paths of a car can be built.

    A piece is, for example, a lane from one junction to the next. A sequence of
    pieces is called a way. An edge of the graph leads from a piece to each
    piece that can follow it.

    Attributes:
        lengths: (N,) lengths of the pieces [m].
        is_open: (N,) whether a car can drive along a piece, as far as is known.
    """

    def __init__(
        self,
        lengths: np.ndarray,
        before: np.ndarray,
        after: np.ndarray,
        costs: np.ndarray | None = None,
    ):
        """Links pieces: `before[k]` leads into `after[k]`, for L links.

        `lengths` (N,) contains the lengths of the pieces [m]. `costs` (L,)
        contains the cost of each link, from the middle of a piece to the middle
        of the next piece. If `costs` is None, each cost is the length of the
        link [m].
        """
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
