"""Writing messages in a thread, while the next frame is computed.

Compression takes half of a frame's time, and other Python code can run
meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable
import queue
import threading
from typing import Any

# Number of messages that may wait, each with the small ones before it: two
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
    drops waiting messages. An error of the thread is raised by the next
    `write`, or on leaving.
    """

    def __init__(self, write: Callable[..., None]):
        """Starts nothing yet; `write` is called in a thread of its own."""
        self._write = write
        self._messages: queue.Queue = queue.Queue(_WAITING)
        self._held: list[tuple[Any, ...]] = []
        self._error: BaseException | None = None
        self._dropping = False
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> BackgroundWriter:
        self._thread.start()
        return self

    def __exit__(self, exception_type: type | None, *_: object) -> None:
        self._dropping = exception_type is not None
        self._messages.put(self._held)
        self._messages.put(None)
        self._thread.join()
        if exception_type is None:
            self._raise_error()

    def write(self, *message: Any) -> None:
        """Hands a message over; waits while too many are waiting.

        Raises:
            Whatever writing an earlier message raised.
        """
        self._raise_error()
        self._held.append(message)
        size = sum([len(one) for one in message if isinstance(one, bytes)])
        if 0 < size < _SMALL_BYTES and len(self._held) < _MOST_HELD:
            return
        self._messages.put(self._held)
        self._held = []

    def _raise_error(self) -> None:
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        # After an error messages are still taken from the queue, so that no
        # caller waits for room for ever.
        while (messages := self._messages.get()) is not None:
            for message in messages:
                if self._error is None and not self._dropping:
                    try:
                        self._write(*message)
                    except BaseException as error:
                        self._error = error
