"""Decoded messages of the topics of an MCAP file."""

import contextlib
from pathlib import Path
from typing import Any

import numpy as np

from cns_drake.base import InputError, parse_json, value_errors
from cns_drake.drives import mcap_messages
from cns_drake.drives.mcap_file import McapFile
from cns_drake.drives.message_rows import MessageRows, check_agreement


class McapTopics:
    """Reads and decodes messages of an MCAP file; errors name file and topic.

    Attributes:
        file: the file.
        path: path of the file.
    """

    def __init__(self, path: Path):
        """Opens a file; no topic is read yet.

        Raises:
            InputError: there is no complete MCAP file.
        """
        self.file = McapFile(path)
        self.path = self.file.path
        self._types: dict[str, str] = {}

    def __contains__(self, topic: str) -> bool:
        """Returns whether messages of a topic can be decoded."""
        return topic in self._types

    def require(self, topic: str, message_type: str) -> None:
        """Checks that a topic has messages, all of one type in CDR.

        Raises:
            InputError: the topic has no message, or messages of other types.
        """
        found = self.file.topics.get(topic)
        if found is None:
            raise InputError(f"{self.path}: no topic {topic}")
        if found != [f"{message_type} in cdr"]:
            raise InputError(
                f"{self.path}: {topic}: {' and '.join(found)} instead of"
                f" {message_type} in cdr"
            )
        if len(self.file.locate(topic)) == 0:
            raise InputError(f"{self.path}: {topic}: no message")
        self._types[topic] = message_type

    def find(self, message_type: str) -> list[str]:
        """Returns all topics whose messages are of one type, in CDR.

        The messages of these topics can then be decoded.
        """
        found = [
            topic
            for topic, kinds in self.file.topics.items()
            if kinds == [f"{message_type} in cdr"]
        ]
        self._types |= dict.fromkeys(found, message_type)
        return found

    def message(self, topic: str, place: np.void) -> Any:
        """Returns the decoded message at a location in the file.

        Args:
            topic: topic of the message.
            place: the location, a row of `McapFile.locate`.

        Raises:
            InputError: the message cannot be read or decoded.
        """
        data = self.file.read(place)
        with self.faults(topic):
            return mcap_messages.decode(data, self._types[topic])

    def first(self, topic: str) -> Any:
        """Returns the first message of a topic, decoded."""
        return self.message(topic, self.file.locate(topic)[0])

    def rows(self, topic: str) -> np.ndarray:
        """Returns all messages of a topic of odometry or of an IMU as rows.

        Raises:
            InputError: a message cannot be read, or two different messages have
                the same stamp.
        """
        places = self.file.locate(topic)
        rows = MessageRows(self._types[topic], len(places))
        with self.faults(topic):
            for index, data in self.file.visit(places):
                rows.add(index, data)
            found = rows.rows()
            check_agreement(found)
        return found

    def logged_stamps_ns(self, topic: str) -> np.ndarray | None:
        """Returns the stamps (N,) of a topic's messages [ns] from the index.

        The result is None if the file does not state that the log times of the
        topic are stamps.
        """
        places = self.file.locate(topic)
        records = self.file.metadata(mcap_messages.STAMPED_RECORD)
        if [record.get(topic) for record in records] != [str(len(places))]:
            return None
        for place in places[[0, -1]]:
            with self.faults(topic):
                stamp_ns = mcap_messages.read_stamp(self.file.read(place))
            if stamp_ns != place["log_time_ns"]:
                return None
        return places["log_time_ns"].astype(np.int64)

    def json(self, name: str) -> Any:
        """Returns the value of a JSON attachment; None if the file lacks it.

        Raises:
            InputError: the attachment cannot be read, or is not JSON.
        """
        data = self.file.attachment(name)
        with self.faults(f"attachment {name}"):
            return None if data is None else parse_json(data)

    def faults(self, where: str) -> contextlib.AbstractContextManager[None]:
        """Turns a ValueError into an InputError that names file and place."""
        return value_errors(f"{self.path}: {where}")
