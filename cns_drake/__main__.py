"""The starts of `cns-drake` (`python -m cns_drake`) and of `cns-eval`."""

from collections.abc import Callable
import sys

from cns_drake.base import leave_out_folder

leave_out_folder(sys.path)  # Before anything else is imported.

from cns_drake.base import start  # noqa: E402


def main() -> None:
    """Runs the command `cns-drake`."""
    start("cns-drake", _load)


def evaluate() -> None:
    """Runs the command `cns-eval`."""
    start("cns-eval", _load_evaluation)


def _load() -> Callable[[], None]:
    from cns_drake.command_line import main as run

    return run


def _load_evaluation() -> Callable[[], None]:
    from evaluation.command_line import main as run

    return run


if __name__ == "__main__":
    main()
