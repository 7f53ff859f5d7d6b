"""`python -m cns_drake` is the command `cns-drake`."""

from collections.abc import Callable
import sys

from cns_drake.base import check_evaluation, leave_out_folder

leave_out_folder(sys.path)  # Before anything else is imported.

from cns_drake.base import start  # noqa: E402


def main() -> None:
    """Runs the command."""
    start("cns-drake", _load)


def _load() -> Callable[[], None]:
    check_evaluation()
    from cns_drake.command_line import main as run

    return run


if __name__ == "__main__":
    main()
