"""Streets of an imported city, and where they meet."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

# Height of sidewalks above the carriageway [m].
KERB_HEIGHT = 0.12
# Width of a sidewalk whose file gives none [m].
SIDEWALK_WIDTH = 2.0


@dataclass(frozen=True)
class Street:
    """A street, on which cars drive forwards, backwards or both.

    Attributes:
        line: (N, 2) middle of the street, from start to end [m].
        nodes: a node for each point of `line`; streets meet at common nodes.
        forward: whether cars drive in the direction of `line`.
        backward: whether cars drive against this direction.
        aside: lateral offset of the outermost lane from the middle [m].
        width: width of the carriageway [m]; 0 if unknown.
        name: name of the street in the file.
        tags: tags of the street in the file.
    """

    line: np.ndarray
    nodes: tuple[int, ...]
    forward: bool
    backward: bool
    aside: float
    width: float = 0.0
    name: str = ""
    tags: Mapping[str, str] = field(default_factory=dict)


class StreetPiece(NamedTuple):
    """A piece of a street between two nodes.

    Attributes:
        street: the whole street.
        line: (N, 2) middle of the piece, in the direction of the street's line
            [m].
        nodes: the first and the last node of the piece.
    """

    street: Street
    line: np.ndarray
    nodes: tuple[int, int]


def ends_at_nodes(streets: Iterable[Street]) -> Counter[int]:
    """Returns the number of street ends at each node.

    A street that passes through a node counts as two ends.
    """
    ends: Counter[int] = Counter()
    for street in streets:
        last = len(street.nodes) - 1
        for k, node in enumerate(street.nodes):
            ends[node] += 1 if k in (0, last) else 2
    return ends


def cut_at_nodes(streets: Sequence[Street]) -> Iterator[StreetPiece]:
    """Yields the pieces of streets, cut where they meet.

    The pieces of a street follow each other in the direction of its line.
    """
    uses = Counter(node for street in streets for node in street.nodes)
    for street in streets:
        last = len(street.nodes) - 1
        cuts = [
            k
            for k, node in enumerate(street.nodes)
            if k in (0, last) or uses[node] > 1
        ]
        for first, after in pairwise(cuts):
            line = street.line[first : after + 1]
            ends = street.nodes[first], street.nodes[after]
            yield StreetPiece(street, line, ends)
