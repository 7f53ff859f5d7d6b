"""Commands that a command suggests as the next one."""

from pathlib import Path

from cns_drake.base.terminal import next_command


def suggest_reproduction(folder: Path) -> None:
    """Names the command that simulates the drives of a new map."""
    words = ("reproduce", folder, "--output", "study", "--no-recordings")
    next_command("cns-drake", *words)
