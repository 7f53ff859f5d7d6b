"""Notes of recordings, for the user."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cns_drake.base import terminal

if TYPE_CHECKING:
    from cns_drake.base.recordings.sequence import Sequence


def print_notes(sequence: Sequence) -> None:
    """Prints how a recording was read."""
    for note in sequence.notes:
        terminal.note(note)
