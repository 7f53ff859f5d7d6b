"""Commands that a command suggests as the next one.

A suggested command works on the files that are there when it is suggested.
"""

from __future__ import annotations

from collections.abc import Sequence
import contextlib
import os
from pathlib import Path
from typing import TYPE_CHECKING

from evaluation.base import InputError, terminal

if TYPE_CHECKING:
    from cns_drake.scenarios import Scenario
    from evaluation.recognition import RetrievalProtocol

# Folder of recordings in the suggestions.
_RECORDINGS = Path("drives")


def suggest_export(recording: Path, scenario: Scenario) -> None:
    """Names the command that exports a new recording to a new folder."""
    for output in (Path("kitti"), Path(f"kitti_{recording.name}")):
        if not os.path.lexists(output):
            break
    else:
        return
    words: tuple[object, ...] = (recording, "--format", "kitti")
    lidars = tuple(scenario.lidars)
    if len(lidars) > 1 and "lidar" not in lidars:
        # Without a name, an export takes the LiDAR named `lidar`.
        words += ("--lidar", lidars[0])
    terminal.next_command("cns-drake", "export", *words, "--output", output)


def suggest_evaluation(recording: Path, exported: Path) -> None:
    """Names the command that compares an export with its recording."""
    from evaluation.drives import open_drive

    with contextlib.suppress(InputError):  # Such as of a single scan.
        open_drive(exported)
        terminal.next_command("cns-eval", "tcr", recording, exported)


def suggest_recognition(
    drives: Sequence[Scenario],
    words: Sequence[str],
    table: Path,
    protocol: RetrievalProtocol,
) -> None:
    """Names the command that uses a table of overlaps.

    It needs recordings of both drives. If they are not there yet, the command
    that makes them is named first.

    Args:
        drives: database and query drive.
        words: words with which the command line named both drives.
        table: the table.
        protocol: protocol of the table.
    """
    folders = [_RECORDINGS / drive.name for drive in drives]
    if not all(map(os.path.lexists, folders)):
        terminal.next_command(
            "cns-drake", "generate", *words, "--output", _RECORDINGS
        )
    usual = type(protocol)()
    given: list[object] = []
    if protocol.query_spacing != usual.query_spacing:
        given += ["--query-spacing", protocol.query_spacing]
    if protocol.half_extent != usual.half_extent:
        given += ["--half-extent", protocol.half_extent]
    terminal.next_command(
        "cns-eval",
        "pr",
        *folders,
        "--method",
        "solid",
        "--truth",
        "overlap:0.5",
        "--exact-overlaps",
        table,
        *given,
    )


def suggest_page(scenario: Scenario, word: str) -> None:
    """Names the command that records a drive, and writes a page of it."""
    if not os.path.lexists(_RECORDINGS / scenario.name):
        words = ("--output", _RECORDINGS, "--recording", "drive.html")
        terminal.next_command("cns-drake", "simulate", word, *words)


def suggest_reproduction(folder: Path) -> None:
    """Names the command that simulates the drives of a new map."""
    words = ("reproduce", folder, "--output", "study", "--no-recordings")
    terminal.next_command("cns-drake", *words)
