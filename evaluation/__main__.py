"""`python -m evaluation` is the command `cns-eval`."""

from collections.abc import Callable

from evaluation.base import start


def main() -> None:
    """Runs the command `cns-eval`."""
    start("cns-eval", _load)


def _load() -> Callable[[], None]:
    from evaluation.command_line import main as run

    return run


if __name__ == "__main__":
    main()
