"""The same work on one process or on several."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
import multiprocessing
import os
from typing import Any

from evaluation.errors import InputError
from evaluation.progress import Track, silent


def num_cores() -> int:
    """Returns how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Workers:
    """Calls functions, in this process or in some of its own.

    A context manager. With one job no process is started. Functions,
    arguments and results must be picklable otherwise. The results do not
    depend on the number of jobs.
    """

    def __init__(self, num_jobs: int):
        """Starts the processes.

        Raises:
            InputError: if the number is not positive.
        """
        if num_jobs < 1:
            raise InputError(f"--jobs: {num_jobs} is not a positive number")
        self._pool = None
        if num_jobs > 1:
            # Not forked: this process may have threads that hold locks.
            self._pool = ProcessPoolExecutor(
                num_jobs, multiprocessing.get_context("spawn")
            )

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *error) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def map(
        self,
        function: Callable,
        arguments: Iterable[tuple],
        description: str,
        track: Track = silent,
    ) -> list:
        """Returns `function(*a)` for each of the arguments, in their order.

        Raises:
            Whatever the function raises.
            InputError: if a process dies, as by lack of memory.
        """
        calls = list(arguments)
        results = self._results(function, calls)
        return list(track(results, description, len(calls)))

    def _results(self, function: Callable, calls: list[tuple]) -> Iterator[Any]:
        if self._pool is None:
            for call in calls:
                yield function(*call)
            return
        futures = [self._pool.submit(function, *call) for call in calls]
        for future in futures:
            try:
                yield future.result()
            except BrokenProcessPool as error:
                raise InputError(
                    "--jobs: a process died, perhaps for lack of memory; try"
                    " fewer"
                ) from error
