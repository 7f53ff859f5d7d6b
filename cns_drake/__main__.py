"""`python -m cns_drake` is the command `cns-drake`.

The command `cns-eval` starts here as well: where another package `evaluation`
hides ours, this module is found, and says so.
"""

from collections.abc import Callable
import sys

from cns_drake.base import check_evaluation, leave_out_folder

leave_out_folder(sys.path)  # Before anything else is imported.

from cns_drake.base import start  # noqa: E402


def main() -> None:
    """Runs the command `cns-drake`."""
    start("cns-drake", _load)


def evaluate() -> None:
    """Runs the command `cns-eval`."""
    start("cns-eval", _load_evaluation)


def _load() -> Callable[[], None]:
    check_evaluation()
    from cns_drake.command_line import main as run

    return run


def _load_evaluation() -> Callable[[], None]:
    check_evaluation()
    from evaluation.command_line import main as run

    return run


if __name__ == "__main__":
    main()
