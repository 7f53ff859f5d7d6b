"""Notes of recordings, for the user."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cns_drake.base import terminal

if TYPE_CHECKING:
    from cns_drake.base.drives.drive import Drive


def print_notes(drive: Drive) -> None:
    """Prints how a recording was read."""
    for note in drive.notes:
        terminal.note(note)
