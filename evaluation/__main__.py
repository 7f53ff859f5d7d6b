"""The start of `cns-eval` (`python -m evaluation`)."""

from collections.abc import Callable

from evaluation.base import leave_working_folder

leave_working_folder()  # Before anything else is imported.


def main() -> None:
    """Runs the command `cns-eval`."""
    from evaluation.base import start

    start("cns-eval", _load)


def _load() -> Callable[[], None]:
    from evaluation.command_line import main as run

    return run


if __name__ == "__main__":
    main()
