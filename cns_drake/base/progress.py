"""Progress of long work."""

from collections.abc import Callable, Iterable
from typing import Any

# Without a terminal, a line of progress is printed this often [s].
LINE_INTERVAL = 5.0
# Wraps the items of a long loop: (items, what is being done, how many).
Track = Callable[[Iterable[Any], str, int], Iterable[Any]]


def silent(items: Iterable[Any], description: str, total: int) -> Iterable[Any]:
    """Returns `items` unchanged: a progress callback that shows nothing.

    Use it where a function takes a callback like
    `cns_drake.base.terminal.track`.
    """
    return items
