"""Starts the two command-line programs."""

from collections.abc import Callable
import os
import sys

from evaluation.base.errors import InputError
from evaluation.base.interrupts import (
    end_interrupted,
    ended_by_interrupts,
    interrupt_on_termination,
)
from evaluation.base.process import ONE_CORE, collect_garbage_seldom
from evaluation.base.working_folder import ignore_local_settings


def start(program: str, load: Callable[[], Callable[[], None]]) -> None:
    """Imports and runs a program; reports errors and interrupts in one line.

    After an `InputError`, the process exits with the status of the error. After
    an interrupt (Ctrl-C or SIGTERM), the process ends without a traceback.

    Args:
        program: name of the program.
        load: function that imports the program's main function and returns it.
    """
    # NumPy reads these settings when it is imported. A user's own settings win.
    for name, value in ONE_CORE.items():
        os.environ.setdefault(name, value)
    try:
        ignore_local_settings()
        interrupt_on_termination()
        collect_garbage_seldom()
        with ended_by_interrupts(program):
            run = load()
        run()
    except InputError as error:
        print(f"{program}: error: {error}", file=sys.stderr)
        sys.exit(error.exit_status)
    except KeyboardInterrupt:
        print(f"{program}: interrupted", file=sys.stderr)
        end_interrupted()
