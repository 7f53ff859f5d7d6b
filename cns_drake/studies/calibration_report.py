"""What a calibration of stages found, in lines for people to read."""

from __future__ import annotations

from collections.abc import Iterator

from cns_drake.studies.calibration import Calibration, Group


def report_lines(
    calibration: Calibration, target: float | None = None
) -> Iterator[str]:
    """Yields what a calibration finds, for people to read.

    Args:
        calibration: of two stages.
        target: the TCR_sym to propose a change for, if any.
    """
    yield f"TCR_sym {calibration.change:.4f}"
    yield f"control {calibration.control:.4f}"
    yield "each group's contribution, if it alone stood:"
    for group, change in calibration.contributions().items():
        yield f"  {change:+.4f} {_described(group, len(group.names))}"
    if target is None:
        return
    proposal = calibration.propose(target)
    verb = "give back" if proposal.gives_back else "take away as well"
    yield f"for TCR_sym {proposal.change:.4f}, near {target}, {verb}:"
    whole = {
        (group.stage, group.item): len(group.names)
        for group in calibration.given_back + calibration.taken
    }
    for group in proposal.groups:
        size = whole[group.stage, group.item]
        yield f"  {_described(group, size)}"
        if len(group.names) < size:
            yield f"    {', '.join(group.names)}"
    if not proposal.groups:
        yield "  nothing"


def _described(group: Group, size: int) -> str:
    count = len(group.names)
    extent = f"all {size}" if count == size else f"the first {count} of {size}"
    return f"{group.stage} {group.item}".rstrip() + f": {extent}"
