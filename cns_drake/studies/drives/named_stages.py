"""Words for stages of a map, such as `last`, in experiments."""

from typing import Any

from cns_drake.scenarios import Scenario
from evaluation.base import InputError, natural_key
from evaluation.results import LAST, OWN

# The first stage of a map.
_FIRST = "first"
# The beginning of words for earlier stages than the last, such as `earlier 1`.
_EARLIER = "earlier "
# Number of words for earlier stages: `earlier 1` to `earlier 4`.
_STEPS = 4


class MissingError(Exception):
    """Raised if a map lacks what a condition needs; the message says what."""


def find_stage(wanted: Any, drive: Scenario, last: str) -> str:
    """Returns the stage that an experiment names.

    Args:
        wanted: the name of a stage, or a word: `own` for the drive's own stage,
            `last`, `first`; or `earlier 1` to `earlier 4` for the stages before
            the last one, from newer to older.
        drive: a drive on the map.
        last: the stage that the word `last` means.

    Raises:
        MissingError: the map has no such earlier stage.
        InputError: there is no such stage or word.
    """
    stages = list(drive.folder.stages())
    own = str(drive.stage)
    words = {OWN: own, LAST: last, _FIRST: next(iter(stages), own)}
    if isinstance(wanted, str) and wanted in words:
        return words[wanted]
    if isinstance(wanted, str) and wanted.startswith(_EARLIER):
        step = wanted.removeprefix(_EARLIER)
        if step in map(str, range(1, _STEPS + 1)):
            before = [
                one for one in stages if natural_key(one) < natural_key(last)
            ]
            return _earlier_stage(int(step), before, last)
    if wanted in stages:
        return str(wanted)
    raise InputError(
        f"{wanted!r}: {drive.folder.name} has {', '.join(stages)}; or give"
        f" {OWN}, {LAST}, {_FIRST} or '{_EARLIER}1' to '{_EARLIER}{_STEPS}'"
    )


def _earlier_stage(step: int, before: list[str], last: str) -> str:
    """Returns the stage that the word `earlier STEP` means.

    Args:
        step: 1 for the newest of the earlier stages, `_STEPS` for the oldest.
        before: all stages before the last one, from older to newer.
        last: the last stage, for the error message.
    """
    if not before:
        raise MissingError(f"no stage before {last}")
    number = min(_STEPS, len(before))
    back = _STEPS - step
    if back >= number:
        raise MissingError(
            f"stages before {last}: {len(before)}, so none for"
            f" '{_EARLIER}{step}'"
        )
    return before[back * (len(before) - 1) // max(1, number - 1)]
