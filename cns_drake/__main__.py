"""`python -m cns_drake` is the command `cns-drake`."""

import sys

from cns_drake.isolation import prefer_ours

prefer_ours()  # Before anything of it is imported.

from evaluation.support.interrupts import (  # noqa: E402
    end_interrupted,
    interrupt_on_termination,
    uninterrupted,
)


def main() -> None:
    """Runs the command; an interrupt while it is imported is no fault."""
    try:
        interrupt_on_termination()
        with uninterrupted():
            from cns_drake.command_line.cli import main as run
        run()
    except KeyboardInterrupt:
        print("cns-drake: interrupted", file=sys.stderr)
        end_interrupted()


if __name__ == "__main__":
    main()
