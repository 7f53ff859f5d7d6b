"""What a file stands for if its parts are put in at each place that names them.

A few lines can name each other such that they stand for billions of parts.
"""

from collections.abc import Callable, Hashable, Iterable
from typing import TypeVar

_Node = TypeVar("_Node", bound=Hashable)
# Greatest number of parts that repetitions may add to those of a file.
_MOST_REPEATED = 100_000


def check_expansion(
    root: _Node,
    parts: Callable[[_Node], Iterable[_Node]],
    size: Callable[[_Node], int] = lambda node: 1,
) -> int:
    """Returns the size of a graph whose nodes are put in wherever named.

    Each node is looked at once, however often it is named.

    Args:
        root: node at which the graph begins.
        parts: returns the nodes that a node names, as often as it names them.
        size: returns the size of a node without its parts; by default one.

    Raises:
        ValueError: a node contains itself, or the graph stands for far more
            than its nodes.
    """
    inside: dict[_Node, list[_Node]] = {}
    sizes: dict[_Node, int] = {}
    written = 0
    waiting = [root]
    while waiting:
        node = waiting[-1]
        if node not in inside:
            inside[node] = [*parts(node)]
            for part in reversed(inside[node]):
                if part not in sizes:
                    if part in inside:
                        raise ValueError("contains itself")
                    waiting.append(part)
        else:
            waiting.pop()
            if node not in sizes:
                own = size(node)
                written += own
                sizes[node] = own + sum(sizes[part] for part in inside[node])
    if sizes[root] > written + _MOST_REPEATED:
        raise ValueError(
            f"its {written} parts stand for {sizes[root]}, because they name"
            " each other many times"
        )
    return sizes[root]
