"""Events in a city that ages."""

from dataclasses import dataclass

# A structure is put up as a consequence of another event.
PUT_UP = "put_up"
# A structure is removed as a consequence of another event.
TAKEN_DOWN = "taken_down"


@dataclass(frozen=True)
class Event:
    """A row of `history.csv`: what happened to a structure in a year.

    Attributes:
        year: year relative to today, which is 0.
        event: kind of event, such as `demolished` or `planted`.
        structure: name of the structure.
        successor: name of the structure that takes its place; "" if there is
            none.
        detail: further text on the event, such as the height of a new tree.
    """

    year: int
    event: str
    structure: str
    successor: str = ""
    detail: str = ""
