"""Messages of bags that `McapFile` does not read, by the package rosbags.

These are rosbag2 with SQLite, of several files or compressed, and ROS 1.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
import contextlib
from dataclasses import dataclass
import heapq
import itertools
import operator
import os
from pathlib import Path
import re
import struct
import tempfile
import threading
from typing import Any
import zlib

import numpy as np
from rosbags.highlevel import AnyReader

from evaluation.base import (
    NS_PER_S,
    InputError,
    check_regular,
    is_there,
    listed,
    reading,
)
from evaluation.drives import mcap_messages, ros_messages
from evaluation.drives.bag_index import BagIndex, Entry, check_unpacked
from evaluation.drives.mcap_file import LOCATION

# How to read a damaged bag of ROS 1, for error messages.
_ADVICE = " (rosbag reindex FILE, of ROS 1, saves what is intact)"
# How a bag of ROS 1 begins; its header has the place of the index.
_MAGIC = b"#ROSBAG V2.0"
_START_BYTES = 4200
# Characters with a meaning in an address.
_IN_ADDRESSES = re.compile("[?#%]")
# A header of ROS 1 begins with a number, seconds and nanoseconds.
_HEADER_1 = struct.Struct("<III")
# A file of a recording begins this long after the end of the one before, at
# most [ns].
NEXT_NS = 5 * NS_PER_S
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

    Threads, and forks of a process, each open the bag for themselves. The
    locations of a topic's messages are found by reading the topic once. In
    a location, `offset` is the number of the message in its topic, and
    `channel_id` is the number of the topic.

    Attributes:
        path: the bag, for messages.
        files: its files.
        names: names of those that hold messages.
        library: name of the program that wrote it, which is unknown.
        joints_ns: log times at which a file ends and the next begins [ns].
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
        files = listed(self.path) if self.path.is_dir() else [*paths]
        check_finished(files)
        bags = [
            one
            for one in files
            if {"bag", "db3", "mcap"} & {*one.name.lower().split(".")}
        ]
        self.names = [one.name for one in bags]
        self.files = (*bags, *(one for one in files if one not in bags))
        self._paths = list(paths)
        self._local = threading.local()
        self._opened: list[_Opened] = []
        self.joints_ns = self._joints(paths)
        connections = self._here.connections
        self._names = sorted(connections)
        self._counts = {
            topic: sum(one.msgcount for one in of_topic)
            for topic, of_topic in connections.items()
        }
        self._kinds = {
            topic: sorted({one.msgtype for one in of_topic})
            for topic, of_topic in connections.items()
        }
        self.index = BagIndex(self.files, self._entries)
        self._locations: dict[str, np.ndarray] = {}

    @property
    def _here(self) -> _Opened:
        """The bag as this thread of this process has opened it.

        Threads would move each other's place in the file, and so would a
        process and its fork, which share it.
        """
        found: _Opened | None = getattr(self._local, "opened", None)
        if found is None or found.pid != os.getpid():
            with reading(self.path), self._faults():
                found = _Opened.of(self._paths)
            self._local.opened = found
            # What a parent has opened stays open: closing it would remove the
            # files that it uncompressed.
            self._opened.append(found)
        return found

    def __del__(self) -> None:
        """Closes the bag, and removes what was uncompressed for it."""
        for one in getattr(self, "_opened", ()):
            if one.pid == os.getpid():
                with contextlib.suppress(Exception):
                    one.reader.close()
            else:
                _OF_PARENTS.append(one)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the files that were joined."""
        if len(self.names) < 2:
            return ()
        return (
            f"{self.path}: {len(self.names)} files are read as one recording:"
            f" {' '.join(self.names)}",
        )

    def _joints(self, paths: Sequence[Path]) -> list[int]:
        """Returns where files are joined; checks that those of ROS 1 may be."""
        given: Any = self._here.reader.readers
        if self._here.reader.is2:
            parts = getattr(given[0].storage, "storages", [given[0].storage])
            # An empty file ends at 0.
            ends_ns = [one.metadata.end_time for one in parts]
            return sorted(filter(None, ends_ns))[:-1]
        readers = sorted(given, key=lambda one: one.start_time)
        for before, after in itertools.pairwise(readers):
            gap_ns = after.start_time - before.end_time
            first, second = (
                {
                    (one.topic, one.msgtype)
                    for one in reader.connections
                    if one.msgtype in ros_messages.CLOUDS
                }
                for reader in (before, after)
            )
            why = ""
            shorter_ns = min(
                one.end_time - one.start_time for one in (before, after)
            )
            if -gap_ns > min(NS_PER_S, shorter_ns // 2):
                why = "are of the same time"
            elif gap_ns > NEXT_NS:
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
            topic: kinds
            for topic, kinds in self._kinds.items()
            if self._counts[topic]
        }

    @property
    def empty_topics(self) -> list[str]:
        """Topics without a message."""
        used = self.topics
        return [one for one in self._names if one not in used]

    def locate(self, topic: str) -> np.ndarray:
        """Returns the locations (N,) of a topic's messages, in their order."""
        if topic not in self._locations:
            times_ns = self.index.of(topic).log_times_ns
            found = np.zeros(len(times_ns), LOCATION)
            found["offset"] = np.arange(len(times_ns))
            found["log_time_ns"] = times_ns
            found["channel_id"] = self._names.index(topic)
            self._locations[topic] = found
        return self._locations[topic]

    def read(self, location: np.void) -> memoryview:
        """Returns the message at a location, in CDR."""
        with reading(self.path):
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
            index = self.index.of(topic)
            if index.has_contents:
                for row in rows.tolist():
                    offset = int(locations["offset"][row])
                    yield row, index.message(offset)
                continue
            here = self._here
            with self._faults():
                found = here.messages([topic], start, stop)
                for offset, (connection, _, data) in zip(
                    offsets, found, strict=True
                ):
                    if offset in row_of:
                        yield row_of[offset], here.packed(connection, data)

    def _entries(
        self, topics: Collection[str], kept: Collection[str]
    ) -> Iterator[Entry]:
        """Yields all messages of topics, see `BagIndex`."""
        here = self._here
        size = sum(file.stat().st_size for file in self.files)
        total = 0
        with self._faults():
            for connection, time_ns, data in here.messages(topics):
                topic = connection.topic
                total += len(data)
                check_unpacked(total, size)
                yield Entry(
                    topic,
                    time_ns,
                    here.stamp_ns(data),
                    zlib.crc32(data),
                    here.packed(connection, data) if topic in kept else None,
                )

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
        except (InputError, MemoryError):
            raise
        except Exception as error:
            # rosbags, SQLite and the compression raise errors of any class.
            raise InputError(
                f"{self.path}: the bag cannot be read"
                f" ({type(error).__name__}: {_told(error)}){self._advice()}"
            ) from error

    def _advice(self) -> str:
        """Returns what helps against the error of a bag of ROS 1, if known."""
        for file in self.files:
            if file.suffix.lower() != ".bag" or not file.is_file():
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


@dataclass(frozen=True, eq=False)
class _Opened:
    """A bag that a thread of a process has opened.

    Attributes:
        connections: topic -> its connections.
        link: folder with links by which the bag was opened, if any.
    """

    pid: int
    reader: AnyReader
    connections: dict[str, list[Any]]
    link: tempfile.TemporaryDirectory[str] | None

    @classmethod
    def of(cls, paths: Sequence[Path]) -> _Opened:
        """Opens a bag."""
        link = None
        # rosbags puts the path of a SQLite file into an address as it is, and
        # knows endings in lower case.
        if any(
            _IN_ADDRESSES.search(str(one)) or one.suffix != one.suffix.lower()
            for one in paths
        ):
            link = tempfile.TemporaryDirectory(prefix="cns-drake-")
            paths = [
                _linked(Path(link.name) / str(number), one.absolute())
                for number, one in enumerate(paths)
            ]
        reader = AnyReader(paths, default_typestore=ros_messages.known_types())
        reader.open()
        connections: dict[str, list[Any]] = {}
        for one in reader.connections:
            connections.setdefault(one.topic, []).append(one)
        return cls(os.getpid(), reader, connections, link)

    def messages(
        self,
        topics: Iterable[str],
        start: int | None = None,
        stop: int | None = None,
    ) -> Iterator[tuple[Any, int, bytes]]:
        """Yields the messages of topics by log time, and then by file.

        The package's own order of equal times differs between processes.
        """
        wanted = [one for topic in topics for one in self.connections[topic]]
        readers: list[Any] = list(self.reader.readers)
        found = []
        for reader in readers:
            own = [one for one in wanted if one in reader.connections]
            if own:
                found.append(reader.messages(own, start=start, stop=stop))
        return heapq.merge(*found, key=operator.itemgetter(1))

    def packed(self, connection: Any, data: bytes) -> memoryview:
        """Returns a message in CDR."""
        if self.reader.is2:
            return memoryview(data)
        message = self.reader.deserialize(data, connection.msgtype)
        return memoryview(ros_messages.serialize(message))

    def stamp_ns(self, data: bytes) -> int:
        """Returns the stamp of a message that begins with a header; else 0."""
        if self.reader.is2:
            with contextlib.suppress(ValueError):
                return mcap_messages.read_stamp(data) or 0
            return 0
        if len(data) < _HEADER_1.size:
            return 0
        _, sec, nanosec = _HEADER_1.unpack_from(data)
        return int(sec * NS_PER_S + nanosec)


def _told(error: Exception) -> str:
    """Returns what an error of the package says, except what is to be done."""
    return str(error).partition("; please report")[0]


def _linked(folder: Path, path: Path) -> Path:
    """Returns the path of a link, of the same name if it is a file's."""
    folder.mkdir()
    link = folder / (f"bag{path.suffix.lower()}" if path.is_file() else "bag")
    link.symlink_to(path)
    return link


# Bags that were opened before this process was forked.
_OF_PARENTS: list[_Opened] = []


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
