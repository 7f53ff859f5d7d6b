"""`python -m cns_drake` is the command `cns-drake`."""

import sys


def main() -> None:
    """Runs the command; an interrupt while it is imported is no fault."""
    try:
        from cns_drake.cli import main as run

        run()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    main()
