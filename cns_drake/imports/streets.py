"""Streets of an imported city, and where they meet."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

# Height of sidewalks above the carriageway [m].
KERB_HEIGHT = 0.12
# Width of a sidewalk whose file gives none [m].
SIDEWALK_WIDTH = 2.0
# Drives and traffic take no sharper turn from one street into another.
SHARPEST_TURN_DEG = 125.0


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


def cut_at_nodes(
    streets: Sequence[Street], also: AbstractSet[int] = frozenset()
) -> Iterator[tuple[Street, np.ndarray, tuple[int, int]]]:
    """Cuts streets where they meet, and at the nodes in `also`.

    Yields:
        For each piece: its street, its middle line (N, 2) [m], and its first
        and its last node.
    """
    uses = Counter(node for street in streets for node in street.nodes)
    for street in streets:
        last = len(street.nodes) - 1
        cuts = [
            k
            for k, node in enumerate(street.nodes)
            if k in (0, last) or uses[node] > 1 or node in also
        ]
        for first, after in pairwise(cuts):
            ends = street.nodes[first], street.nodes[after]
            yield street, street.line[first : after + 1], ends


@dataclass(frozen=True)
class StreetPlaces:
    """Crossings, traffic signals and footpaths of a city.

    Attributes:
        crossed: nodes of streets at which people cross.
        signals: (N, 2) places of traffic signals [m].
        paths: middle lines of footpaths, (M, 2) each [m].
    """

    crossed: AbstractSet[int] = frozenset()
    signals: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    paths: Sequence[np.ndarray] = ()
