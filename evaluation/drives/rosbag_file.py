"""Messages of bags that `McapFile` does not read, by the package rosbags.

These are rosbag2 with SQLite, of several files or compressed, and ROS 1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import contextlib
import itertools
from pathlib import Path
import re
from typing import Any

import numpy as np
from rosbags.highlevel import AnyReader

from evaluation.base import (
    NS_PER_S,
    InputError,
    check_regular,
    is_there,
    listed,
)
from evaluation.drives import ros_types
from evaluation.drives.mcap_file import LOCATION

# How to read a damaged bag of ROS 1, for error messages.
_ADVICE = " (rosbag reindex FILE, of ROS 1, saves what is intact)"
# How a bag of ROS 1 begins; its header has the place of the index.
_MAGIC = b"#ROSBAG V2.0"
_START_BYTES = 4200
# A file of a recording begins this long after the end of the one before, at
# most [ns].
_NEXT_NS = 5 * NS_PER_S
# What SQLite and the recorders leave beside a file that was not closed, by the
# ending of its name. The package rosbags reads none of these.
_UNFINISHED = {
    "-wal": "messages of the bag are in this log only; on a copy of the folder,"
    " `sqlite3 {file} 'PRAGMA wal_checkpoint(TRUNCATE)'` moves them",
    "-journal": "the bag was not closed, and this log undoes a half-written"
    " change; open a copy of the folder once with `sqlite3 {file} .tables`",
    ".active": "the recording was not finished; `rosbag reindex` of a copy"
    " without `.active` saves what is intact",
}


class RosbagFile:
    """A bag, open for reading single messages, like `McapFile`.

    The locations of a topic's messages are found by reading the topic once. In
    a location, `offset` is the number of the message in its topic, and
    `channel_id` is the number of the topic.

    Attributes:
        path: the bag, for messages.
        files: its files.
        library: name of the program that wrote it, which is unknown.
        joints_ns: log times at which a file of ROS 1 ends and the next begins
            [ns].
    """

    library = ""

    def __init__(self, paths: Sequence[Path]):
        """Opens a bag.

        Args:
            paths: the folder or file of rosbag2, or the files of ROS 1.

        Raises:
            InputError: there is no readable bag, its recorder left a file
                behind that is not read, or the files are not one recording.
        """
        self.path = paths[0] if len(paths) == 1 else paths[0].parent
        self.files = (
            tuple(listed(self.path)) if self.path.is_dir() else tuple(paths)
        )
        check_finished(self.files)
        with self._faults():
            self._reader = AnyReader(
                paths, default_typestore=ros_types.known_types()
            )
            self._reader.open()
        self.joints_ns = self._joints(paths)
        self._connections: dict[str, list[Any]] = {}
        for one in self._reader.connections:
            self._connections.setdefault(one.topic, []).append(one)
        self._names = sorted(self._connections)
        self._locations: dict[str, np.ndarray] = {}

    def __del__(self) -> None:
        """Closes the bag, and removes what was uncompressed for it."""
        with contextlib.suppress(Exception):
            self._reader.close()

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the files that were joined."""
        names = [
            one.name
            for one in self.files
            if {".bag", ".db3", ".mcap"} & set(one.suffixes)
        ]
        if len(names) < 2:
            return ()
        return (
            f"{self.path}: {len(names)} files are read as one recording:"
            f" {' '.join(names)}",
        )

    def _joints(self, paths: Sequence[Path]) -> list[int]:
        """Returns where files of ROS 1 are joined; checks that they may be.

        Raises:
            InputError: a file does not continue the one before it.
        """
        readers: Any = sorted(
            self._reader.readers, key=lambda one: one.start_time
        )
        for before, after in itertools.pairwise(readers):
            gap_ns = after.start_time - before.end_time
            first, second = (
                {
                    (one.topic, one.msgtype)
                    for one in reader.connections
                    if one.msgtype in ros_types.CLOUDS
                }
                for reader in (before, after)
            )
            why = ""
            shorter_ns = min(
                one.end_time - one.start_time for one in (before, after)
            )
            if -gap_ns > min(NS_PER_S, shorter_ns // 2):
                why = "are of the same time"
            elif gap_ns > _NEXT_NS:
                why = f"have {gap_ns / NS_PER_S:.0f} s between them"
            elif first != second:
                why = "have other topics of point clouds"
            if why:
                names = [Path(one.path).name for one in (before, after)]
                raise InputError(
                    f"{self.path}: several recordings: {' and '.join(names)}"
                    f" {why}; give one of {' '.join(p.name for p in paths)}"
                )
        return [one.end_time for one in readers[:-1]]

    @property
    def topics(self) -> dict[str, list[str]]:
        """Maps topics with messages to types, as `McapFile.topics`."""
        return {
            topic: sorted({one.msgtype for one in connections})
            for topic, connections in self._connections.items()
            if any(one.msgcount for one in connections)
        }

    @property
    def empty_topics(self) -> list[str]:
        """Topics without a message."""
        used = self.topics
        return [one for one in self._names if one not in used]

    def locate(self, topic: str) -> np.ndarray:
        """Returns the locations (N,) of a topic's messages, in their order."""
        if topic not in self._locations:
            with self._faults():
                times = [
                    time_ns
                    for _, time_ns, _ in self._reader.messages(
                        self._connections[topic]
                    )
                ]
            found = np.zeros(len(times), LOCATION)
            found["offset"] = np.arange(len(times))
            found["log_time_ns"] = times
            found["channel_id"] = self._names.index(topic)
            self._locations[topic] = found
        return self._locations[topic]

    def read(self, location: np.void) -> memoryview:
        """Returns the message at a location, in CDR."""
        ((_, data),) = self.visit(np.array([location], LOCATION))
        return data

    def visit(self, locations: np.ndarray) -> Iterator[tuple[int, memoryview]]:
        """Yields messages in the bag's order, as `McapFile.visit`."""
        for number in np.unique(locations["channel_id"]).tolist():
            topic = self._names[number]
            rows = np.flatnonzero(locations["channel_id"] == number)
            row_of = {int(locations["offset"][row]): int(row) for row in rows}
            times_ns = self.locate(topic)["log_time_ns"]
            start = int(locations["log_time_ns"][rows].min())
            stop = int(locations["log_time_ns"][rows].max()) + 1
            within = (times_ns >= start) & (times_ns < stop)
            offsets = np.flatnonzero(within).tolist()
            with self._faults():
                found = self._reader.messages(
                    self._connections[topic], start, stop
                )
                for offset, (connection, _, data) in zip(
                    offsets, found, strict=True
                ):
                    if offset not in row_of:
                        continue
                    if self._reader.is2:
                        yield row_of[offset], memoryview(data)
                        continue
                    message = self._reader.deserialize(data, connection.msgtype)
                    packed = ros_types.serialize(message)
                    yield row_of[offset], memoryview(packed)

    def attachment(self, name: str) -> bytes | None:
        """Returns None: such bags have no attachments."""
        return None

    def metadata(self, name: str) -> list[dict[str, str]]:
        """Returns nothing: such bags have no records of metadata."""
        return []

    @contextlib.contextmanager
    def _faults(self) -> Iterator[None]:
        """Turns the errors of a damaged bag into an InputError of one line."""
        try:
            yield
        except InputError:
            raise
        except Exception as error:
            # rosbags, SQLite and the compression raise errors of any class.
            raise InputError(
                f"{self.path}: the bag cannot be read"
                f" ({type(error).__name__}: {error}){self._advice()}"
            ) from error

    def _advice(self) -> str:
        """Returns what helps against the error of a bag of ROS 1, if known."""
        for file in self.files:
            if file.suffix != ".bag" or not file.is_file():
                continue
            with open(file, "rb") as stream:
                start = stream.read(_START_BYTES)
            if not start.startswith(_MAGIC):
                return f" ({file.name} does not begin as a bag of ROS 1)"
            found = re.search(rb"index_pos=(.{8})", start, re.DOTALL)
            place = int.from_bytes(found[1], "little") if found else 0
            if not 0 < place < file.stat().st_size:
                return _ADVICE
        return ""


def check_finished(files: Sequence[Path]) -> None:
    """Refuses a bag beside which its recorder left what is not read.

    Raises:
        InputError: there is such a file.
    """
    for file in files:
        if is_there(file):  # Of a recording that goes on, the file is not.
            check_regular(file)
        for ending, fault in _UNFINISHED.items():
            left = file.with_name(file.name + ending)
            if is_there(left) and left.stat().st_size:
                raise InputError(f"{left}: {fault.format(file=file.name)}")
