"""A piece of work, with its inputs and the files that it writes.

A step has no result except its files. To continue an interrupted study, run the
same steps again, on any machine: finished steps are skipped.
"""

import abc
from collections.abc import Callable, Mapping
from pathlib import Path
import time

from evaluation.base.progress import Listener
from evaluation.base.version import __version__

# How often a step reports its progress at most [s].
_REPORT_INTERVAL = 0.5


class Reporter(Listener):
    """Sends what a step does, and notes for the user."""

    def __init__(self, send: Callable[..., None] = lambda *message: None):
        """Makes a reporter.

        Args:
            send: called with the kind of each message ("doing" or "note") and
                the values of the message. By default nothing is sent.
        """
        self._send = send
        self._activity: str | None = None
        self._reported = 0.0

    def doing(
        self, activity: str, done: int = 0, total: int = 0, unit: str = ""
    ) -> None:
        now = time.monotonic()
        if (
            done >= total
            or activity != self._activity
            or now - self._reported >= _REPORT_INTERVAL
        ):
            self._activity = activity
            self._reported = now
            self._send("doing", activity, int(done), int(total), unit)

    def note(self, text: str) -> None:
        """Reports a note for the user."""
        self._send("note", str(text))


class Step(abc.ABC):
    """A piece of work whose result is files.

    Each subclass is a frozen dataclass, defined at the top level of a module,
    so that any process can unpickle and run a step. Paths in a step are
    absolute.

    Attributes:
        version: number that counts the changes of what the step writes from the
            same inputs. Raise it with each such change.
    """

    version: int = 1

    @property
    @abc.abstractmethod
    def output(self) -> Path | None:
        """File or folder that only one step at a time may write, or None.

        After a lost connection, two copies of a step may be running. A lock
        prevents both from writing this output at the same time; see
        `evaluation.base.file_locks.exclusive`.
        """

    @property
    def words(self) -> str:
        """What the step works on, for messages."""
        return str(self.output)

    @abc.abstractmethod
    def is_done(self) -> bool:
        """Returns whether all files of the step exist and are up to date.

        Raises:
            InputError: a file that this check needs cannot be read.
        """

    @abc.abstractmethod
    def run(self, reporter: Reporter) -> None:
        """Does the work of the step.

        An incomplete file never has its final name.

        Raises:
            InputError: the work cannot be done.
        """

    def made_of(self, inputs: Mapping[str, object]) -> dict[str, object]:
        """Returns the inputs, with the versions of program and step.

        The step's files are up to date if they carry the fingerprint of this
        dictionary.
        """
        return {**inputs, "version": [__version__, self.version]}
