"""Readers of recorded drives and of point clouds, one a format."""

from __future__ import annotations

from pathlib import Path

from evaluation.errors import InputError
from evaluation.sequences.sequence import Sequence, check_same_world

__all__ = ["Sequence", "check_same_world", "open_sequence"]


def open_sequence(path: Path) -> Sequence:
    """Opens the recorded drive at `path` with the reader it needs.

    Args:
        path: a folder with one .mcap file (as cns-drake and rosbag2 write
            it), or an .mcap file.

    Raises:
        InputError: if nothing there can be read as a sequence.
    """
    # Imported here: the readers' libraries are slow to load, and a map file
    # needs none of them.
    from evaluation.sequences import mcap_sequence

    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: no such file or folder")
    if mcap_sequence.holds_mcap(path):
        return mcap_sequence.McapSequence(path)
    if path.is_dir() and any(path.glob("*.mcap.part")):
        raise InputError(f"{path}: the recording was not finished")
    raise InputError(
        f"{path}: not a recorded sequence (a folder with an .mcap file, or one)"
    )
