"""Checks that the messages of a topic come in the order of time."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from cns_drake.base.errors import InputError
from cns_drake.recording.rosbag2_metadata import Topic


class MessageOrder:
    """The stamps of the last messages on each topic."""

    def __init__(self, folder: Path, topics: Iterable[Topic]):
        """Begins without messages.

        Args:
            folder: of the recording; errors name it.
            topics: of the recording.
        """
        self._folder = folder
        self._latched = {topic.name for topic in topics if topic.latched}
        self._last_ns: dict[str, int] = {}

    def takes(self, topic: str, stamp_ns: int) -> bool:
        """Returns whether the recording takes the next message.

        It does not take a latched message twice.

        Raises:
            InputError: the message is not later than the one before on its
                topic, or before the epoch.
        """
        last_ns = self._last_ns.get(topic)
        if last_ns is not None and topic in self._latched:
            return False
        if stamp_ns < 0:
            raise InputError(
                f"{self._folder}: {topic}: a message at {stamp_ns / 1e9:g} s, "
                "before the epoch; begin the recording with a later start_ns"
            )
        if last_ns is not None and stamp_ns <= last_ns:
            raise InputError(
                f"{self._folder}: {topic}: a message at {stamp_ns / 1e9:g} s "
                f"comes after that at {last_ns / 1e9:g} s; where a simulator "
                "begins again, or its clock goes back, begin a new recording"
            )
        self._last_ns[topic] = stamp_ns
        return True
