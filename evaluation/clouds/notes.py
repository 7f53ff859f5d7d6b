"""Notes for the user on how files of clouds were read."""

from collections.abc import Callable

# A function that takes a note for the user.
OnNote = Callable[[str], None]


def no_note(note: str) -> None:
    """Ignores a note for the user: the default where no notes are wanted."""
