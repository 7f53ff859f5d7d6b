"""The start of `cns-drake` (`python -m cns_drake`)."""

from collections.abc import Callable

from evaluation.base import leave_working_folder

leave_working_folder()  # Before anything else is imported.


def main() -> None:
    """Runs the command `cns-drake`."""
    from evaluation.base import start

    start("cns-drake", _load)


def _load() -> Callable[[], None]:
    from cns_drake.command_line import main as run

    return run


if __name__ == "__main__":
    main()
