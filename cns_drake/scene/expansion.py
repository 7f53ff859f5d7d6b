"""What a file stands for if its parts are put in at each place that names them.

A few lines can name each other such that they stand for billions of parts.
"""

from collections.abc import Callable, Hashable, Iterable
from typing import TypeVar

_Node = TypeVar("_Node", bound=Hashable)


def expanded_size(
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
        ValueError: a node contains itself.
    """
    inside: dict[_Node, list[_Node]] = {}
    sizes: dict[_Node, int] = {}
    waiting = [root]
    while waiting:
        node = waiting[-1]
        if node not in inside:
            inside[node] = [*parts(node)]
            for part in {*inside[node]} - sizes.keys():
                if part in inside:
                    raise ValueError("contains itself")
                waiting.append(part)
        else:
            waiting.pop()
            if node not in sizes:
                within = sum(sizes[part] for part in inside[node])
                sizes[node] = size(node) + within
    return sizes[root]
