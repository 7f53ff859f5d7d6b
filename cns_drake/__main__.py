"""The starts of `cns-drake` (`python -m cns_drake`) and of `cns-eval`."""

from collections.abc import Callable
import sys

from evaluation.base import leave_out_folder

try:
    leave_out_folder(sys.path)  # Before anything else is imported.
except FileNotFoundError:
    print("error: the working folder is not there any more", file=sys.stderr)
    sys.exit(2)

from evaluation.base import start


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
