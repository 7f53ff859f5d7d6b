"""`python -m cns_drake` is the command `cns-drake`."""

import sys

from cns_drake.base.own_packages import check_evaluation, leave_out_folder

leave_out_folder(sys.path)  # Before anything else is imported.

from cns_drake.base.errors import InputError  # noqa: E402
from cns_drake.base.interrupts import (  # noqa: E402
    end_interrupted,
    interrupt_on_termination,
    uninterrupted,
)
from cns_drake.base.process import look_seldom  # noqa: E402


def main() -> None:
    """Runs the command; an interrupt during its import is not an error."""
    try:
        interrupt_on_termination()
        look_seldom()
        with uninterrupted():
            check_evaluation()
            from cns_drake.command_line.cli import main as run
        run()
    except InputError as error:
        print(f"cns-drake: error: {error}", file=sys.stderr)
        sys.exit(error.exit_status)
    except KeyboardInterrupt:
        print("cns-drake: interrupted", file=sys.stderr)
        end_interrupted()


if __name__ == "__main__":
    main()
