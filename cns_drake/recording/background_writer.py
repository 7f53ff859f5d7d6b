"""Writes messages in a thread, while the next frame is computed.

Compression takes half of a frame's time. Other Python code can run during the
compression.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

# Number of batches that may wait to be written: about two frames with one LiDAR
# and traffic, so that a frame does not wait for the frame before. A batch is a
# large message with the small messages before it.
_MOST_WAITING = 8
# Messages with fewer bytes wait for the next large message: handing a small
# message over takes longer than making it.
_SMALL_BYTES = 1024
# At most this many small messages wait.
_MOST_HELD = 64


class BackgroundWriter:
    """A context manager that writes messages to a BagWriter in a thread.

    Messages are written in order. Leaving the context waits until all messages
    are written; leaving the context by an exception drops the messages that are
    still waiting. If writing fails, nothing more is written, and the error is
    raised by a later `write` or on leaving.
    """

    def __init__(self, write: Callable[..., None]):
        """Prepares the writer.

        Args:
            write: function that writes a message, such as `BagWriter.write`. It
                is called in a second thread.
        """
        self._write = write
        self._thread = ThreadPoolExecutor(1)
        self._batches: deque[Future] = deque()
        self._held: list[tuple[Any, ...]] = []

    def __enter__(self) -> BackgroundWriter:
        return self

    def __exit__(self, exception_type: type | None, *_: object) -> None:
        try:
            if exception_type is None:
                self._submit_held(0)
        finally:
            self._thread.shutdown(cancel_futures=True)

    def write(self, *message: Any) -> None:
        """Queues a message for writing; waits while too many are queued.

        Args:
            message: arguments for the function `write` that was given to the
                constructor, such as the arguments of `BagWriter.write`.

        Raises:
            Exception: the error that occurred while an earlier message was
                written.
        """
        self._held.append(message)
        size = sum([len(part) for part in message if isinstance(part, bytes)])
        if not 0 < size < _SMALL_BYTES or len(self._held) >= _MOST_HELD:
            self._submit_held(_MOST_WAITING)

    def _submit_held(self, waiting: int) -> None:
        """Queues held messages, and waits until `waiting` batches are left."""
        before = self._batches[-1] if self._batches else None
        self._batches.append(
            self._thread.submit(self._write_batch, self._held, before)
        )
        self._held = []
        while len(self._batches) > waiting:
            self._batches.popleft().result()

    def _write_batch(self, batch: list[tuple], before: Future | None) -> None:
        if before is not None:
            before.result()  # If the batch before failed, this one fails, too.
        for message in batch:
            self._write(*message)
