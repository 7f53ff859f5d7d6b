"""What a drive needs of all messages of a bag, so that it is read once.

These are the times, stamps and checksums of messages, and the contents of small
ones, such as poses. They are kept in the cache of the user, for the next time
that the same files are opened.
"""

from collections.abc import Callable, Collection, Iterable, Sequence
import contextlib
import hashlib
import io
import json
from pathlib import Path
from typing import NamedTuple

import numpy as np

from evaluation.base import (
    completing,
    mark_used,
    own_cache,
    read_npz,
    reading,
    remove_unused,
    settled_state,
)

# Greatest size of the contents that are kept of a topic.
_MOST_BYTES = 1 << 26
# Greatest size of all that a bag unpacks to: for any bag, and for each byte of
# it. Recordings compress to a tenth; a hostile file, to nothing.
_UNPACKED_BYTES = 1 << 28
_UNPACKED_PER_BYTE = 50
# Changes whenever files of the cache get another form.
_FORM = 1


class Entry(NamedTuple):
    """A message of a bag.

    Attributes:
        topic: its topic.
        log_time_ns: when it was recorded [ns].
        stamp_ns: stamp in its header [ns]; 0 without one.
        checksum: CRC-32 of the message as it is stored.
        packed: the message in CDR; None if its content is not kept.
    """

    topic: str
    log_time_ns: int
    stamp_ns: int
    checksum: int
    packed: bytes | memoryview | None


class TopicIndex(NamedTuple):
    """What is known of the N messages of a topic, in their order.

    Attributes:
        log_times_ns: (N,) uint64 [ns].
        stamps_ns: (N,) int64 [ns]; 0 without a stamp.
        checksums: (N,) uint32 CRC-32 of the messages as they are stored.
        ends: (N,) uint64 where each message ends in `contents`; (0,) if the
            contents are not kept.
        contents: (M,) uint8, the messages in CDR, one after the other.
    """

    log_times_ns: np.ndarray
    stamps_ns: np.ndarray
    checksums: np.ndarray
    ends: np.ndarray
    contents: np.ndarray

    @property
    def has_contents(self) -> bool:
        """Whether the contents are kept."""
        return len(self.ends) == len(self.log_times_ns)

    def message(self, number: int) -> memoryview:
        """Returns the content of a message, which is kept."""
        start = int(self.ends[number - 1]) if number else 0
        content = self.contents.data[start : int(self.ends[number])]
        return memoryview(content)


def check_unpacked(total: int, size: int) -> None:
    """Refuses a bag of `size` bytes that unpacks to `total` or more bytes.

    Raises:
        ValueError: this is implausible.
    """
    if total > _UNPACKED_BYTES + _UNPACKED_PER_BYTE * size:
        raise ValueError("it stands for far more bytes than it has")


class BagIndex:
    """The topics of a bag that a drive reads, each with its `TopicIndex`."""

    def __init__(
        self,
        files: Sequence[Path],
        read: Callable[[Collection[str], Collection[str]], Iterable[Entry]],
    ):
        """Makes an index; nothing is read yet.

        Args:
            files: the files of the bag.
            read: function that yields all messages of topics, given the topics,
                and those whose contents are kept.
        """
        self._files = [Path(one) for one in files]
        self._read = read
        self._kept: dict[str, bool] = {}
        self._found: dict[str, TopicIndex] = {}

    def prepare(self, topics: Iterable[tuple[str, bool]]) -> None:
        """Names topics that are read together.

        Args:
            topics: each with whether its contents are kept.
        """
        self._kept.update(topics)

    def __contains__(self, topic: str) -> bool:
        """Returns whether a topic is one of those that are read together."""
        return topic in self._kept

    def of(self, topic: str) -> TopicIndex:
        """Returns what is known of a topic; reads the bag if necessary."""
        if topic not in self._found:
            wanted = [topic]
            if topic in self._kept:
                wanted = [one for one in self._kept if one not in self._found]
            states = [settled_state(one) for one in self._files]
            for one in wanted:
                if (known := _cached(self._files, states, one)) is not None:
                    self._found[one] = known
            missing = [one for one in wanted if one not in self._found]
            if missing:
                kept = [one for one in missing if self._kept.get(one)]
                with reading(self._files[0]):
                    found = _collect(missing, self._read(missing, kept))
                self._found |= found
                for one in missing:
                    _cache(self._files, states, one, self._found[one])
        return self._found[topic]


def _collect(
    topics: Sequence[str], entries: Iterable[Entry]
) -> dict[str, TopicIndex]:
    """Returns the index of each topic."""
    rows: dict[str, list[tuple[int, int, int]]] = {one: [] for one in topics}
    contents: dict[str, list[bytes] | None] = {one: [] for one in topics}
    sizes = dict.fromkeys(topics, 0)
    for entry in entries:
        topic = entry.topic
        rows[topic].append((entry.log_time_ns, entry.stamp_ns, entry.checksum))
        parts = contents[topic]
        if parts is None or entry.packed is None:
            contents[topic] = None
            continue
        sizes[topic] += len(entry.packed)
        parts.append(bytes(entry.packed))
        if sizes[topic] > _MOST_BYTES:
            contents[topic] = None
    found = {}
    for topic, of_topic in rows.items():
        columns = list(zip(*of_topic, strict=True)) or [(), (), ()]
        parts = contents[topic] or []
        found[topic] = TopicIndex(
            np.array(columns[0], np.uint64),
            np.array(columns[1], np.int64),
            np.array(columns[2], np.uint32),
            np.cumsum([len(one) for one in parts], dtype=np.uint64),
            np.frombuffer(b"".join(parts), np.uint8),
        )
    return found


def _place(files: Sequence[Path], topic: str) -> Path | None:
    """Returns the file of the cache for a topic; None without a cache."""
    cache = own_cache("bags")
    if cache is None:
        return None
    names = [str(one.resolve()) for one in files]
    key = json.dumps([_FORM, topic, *names]).encode(errors="surrogatepass")
    return cache / f"{hashlib.sha256(key).hexdigest()[:32]}.npz"


def _stamp(states: Sequence[list[int] | None], topic: str) -> np.ndarray:
    """Returns what a file of the cache says of the files that it is of."""
    text = json.dumps([_FORM, topic, states])
    return np.frombuffer(text.encode(errors="surrogatepass"), np.uint8)


def _cached(
    files: Sequence[Path], states: Sequence[list[int] | None], topic: str
) -> TopicIndex | None:
    """Returns what the cache has of a topic; None if nothing that is whole."""
    place = _place(files, topic)
    # A cache that cannot be read only costs time.
    with contextlib.suppress(Exception):
        if place is None or None in states or not place.is_file():
            return None
        names = ("of", *TopicIndex._fields)
        columns = read_npz(place, names)
        of = columns.pop("of")
        found = TopicIndex(**columns)
        number = len(found.log_times_ns)
        is_whole = (
            of.tobytes() == _stamp(states, topic).tobytes()
            and [one.dtype.str for one in found]
            == ["<u8", "<i8", "<u4", "<u8", "|u1"]
            and all(one.ndim == 1 for one in found)
            and len(found.stamps_ns) == len(found.checksums) == number
            and len(found.ends) in (0, number)
            and (found.ends[-1:] == len(found.contents)).all()
        )
        if is_whole:
            mark_used(place)
            return found
    return None


def _cache(
    files: Sequence[Path],
    states: Sequence[list[int] | None],
    topic: str,
    found: TopicIndex,
) -> None:
    """Writes what is known of a topic into the cache, if that is possible."""
    place = _place(files, topic)
    if place is None or None in states:
        return
    if [settled_state(one) for one in files] != list(states):
        return  # The bag was changed meanwhile.
    # A cache that cannot be written only costs time.
    with contextlib.suppress(Exception):
        remove_unused(place.parent, "*.npz")
        stream = io.BytesIO()
        np.savez(stream, of=_stamp(states, topic), **found._asdict())
        with completing(place) as part:
            part.write_bytes(stream.getvalue())
