"""`python -m cns_drake` is the command `cns-drake`."""

import sys

from evaluation.interrupts import (
    end_interrupted,
    interrupt_on_termination,
    uninterrupted,
)


def main() -> None:
    """Runs the command; an interrupt while it is imported is no fault."""
    try:
        interrupt_on_termination()
        with uninterrupted():
            from cns_drake.cli import main as run
        run()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        end_interrupted()


if __name__ == "__main__":
    main()
