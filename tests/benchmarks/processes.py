"""Processes that benchmarks measure in; imports nothing that costs memory."""

from collections.abc import Callable, Collection
import multiprocessing
import os


def in_process(
    function: Callable, *arguments, cores: Collection[int] = ()
) -> None:
    """Runs a function in a fresh process.

    Args:
        function: of a module, so that it can be found again.
        arguments: its arguments.
        cores: which the process has; by default those of this one.

    Raises:
        SystemExit: the process fails.
    """
    own = os.sched_getaffinity(0)
    # Set here, all threads of the process inherit it from its start on.
    os.sched_setaffinity(0, cores or own)
    try:
        process = multiprocessing.get_context("spawn").Process(
            target=function, args=arguments
        )
        process.start()
    finally:
        os.sched_setaffinity(0, own)
    process.join()
    if process.exitcode != 0:
        raise SystemExit(f"{function.__name__}: status {process.exitcode}")
