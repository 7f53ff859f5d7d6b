"""Writing messages in a thread, while the next frame is computed.

Compression takes half of a frame's time, and other Python code can run
meanwhile.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

# Number of batches that may wait, each with the small ones before it: two
# frames with one LiDAR and traffic, so that the next frame does not wait for
# the last one. A killed process loses them, at most eight frames.
_WAITING = 8
# Small messages wait for the next larger one, at most this many: handing one
# over takes longer than making it.
_SMALL_BYTES = 1024
_MOST_HELD = 64


class BackgroundWriter:
    """A context manager that passes messages on, in order, in a thread.

    Leaving it waits until everything is written; leaving it by an exception
    drops waiting messages. An error of the thread is raised by a later `write`,
    or on leaving; nothing is written after it.
    """

    def __init__(self, write: Callable[..., None]):
        """Starts nothing yet; `write` is called in a thread of its own."""
        self._write = write
        self._thread = ThreadPoolExecutor(1)
        self._batches: deque[Future] = deque()
        self._held: list[tuple[Any, ...]] = []

    def __enter__(self) -> BackgroundWriter:
        return self

    def __exit__(self, exception_type: type | None, *_: object) -> None:
        try:
            if exception_type is None:
                self._hand_over(0)
        finally:
            self._thread.shutdown(cancel_futures=True)

    def write(self, *message: Any) -> None:
        """Hands a message over; waits while too many are waiting.

        Raises:
            Whatever writing an earlier message raised.
        """
        self._held.append(message)
        size = sum([len(one) for one in message if isinstance(one, bytes)])
        if not 0 < size < _SMALL_BYTES or len(self._held) >= _MOST_HELD:
            self._hand_over(_WAITING)

    def _hand_over(self, waiting: int) -> None:
        """Hands over what is held, and waits until so few batches wait."""
        before = self._batches[-1] if self._batches else None
        self._batches.append(
            self._thread.submit(self._write_batch, self._held, before)
        )
        self._held = []
        while len(self._batches) > waiting:
            self._batches.popleft().result()

    def _write_batch(self, batch: list[tuple], before: Future | None) -> None:
        if before is not None:
            before.result()  # It is done; its error is that of this one.
        for message in batch:
            self._write(*message)
