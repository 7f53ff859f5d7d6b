"""Writes a rosbag2 folder with one MCAP file.

A recording is whole or not there. It grows in a hidden file of its folder, and
gets its final name when it is complete. What an exception leaves is removed,
and what a killed run leaves is removed by the next run.

To read one message, a reader of MCAP has to uncompress the whole chunk that
contains the message. If chunks contained all messages in the order of time, a
reader of the poses would uncompress all clouds as well. Therefore the messages
of a short span of time are collected, and then written topic by topic. The
topics keep the order of their first messages: readers sort messages by their
log times, and messages of equal time by their places in the file.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
import contextlib
import json
import os
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

from mcap.writer import CompressionType, Writer

from cns_drake.recording import rosbag2_metadata
from cns_drake.recording.rosbag2_metadata import Topic, to_yaml
from evaluation.base import (
    InputError,
    __version__,
    completing,
    is_draft_of,
    sole_writer,
    user_errors,
)
from evaluation.drives import STAMPED_RECORD, message_definition, read_stamp

# Length of a span [ns].
_SPAN_NS = 800_000_000
# Several LiDARs or cameras make more than that in a span. Their messages must
# not fill the memory.
_MOST_HELD_BYTES = 1 << 24
# Size of a chunk, before compression, at which it ends [bytes].
_CHUNK_BYTES = 1 << 20


class BagWriter:
    """A context manager that writes one recording as a rosbag2 folder.

    Leaving the context normally completes the recording. Leaving the context by
    an exception removes it. The same calls always produce the same bytes.

    Example:
        from cns_drake import BagWriter, recording_topics

        topics = recording_topics(["lidar"])
        with BagWriter(
            folder, topics, start_ns=0, attachments={}, scenario={}
        ) as bag:
            simulate_with(bag)
    """

    def __init__(
        self,
        folder: Path,
        topics: Sequence[Topic],
        *,
        start_ns: int,
        attachments: Mapping[str, object],
        scenario: Mapping[str, object],
        beside: Mapping[str, object] | None = None,
        custom_data: Mapping[str, str] | None = None,
        fingerprint: str = "",
        overwrite: bool = False,
    ):
        """Checks the target; nothing is written before the context opens.

        Args:
            folder: the rosbag2 folder; its last part names the recording.
            topics: every topic, in the order of the file's channels.
            start_ns: time of the first message, also the nominal time of
                the attachments [ns].
            attachments: name -> value of each attachment of the MCAP file.
                Values are written as YAML if the name ends with `.yaml`,
                otherwise as JSON.
            scenario: the content of `scenario.yaml`, next to the MCAP file.
            beside: name -> content of further YAML files next to the MCAP file.
            custom_data: key -> text for `ros2 bag info`.
            fingerprint: the content of `fingerprint.txt`; no file if empty.
            overwrite: whether an existing recording may be replaced. A finished
                recording stays until the new one is complete.

        Raises:
            InputError: if the folder contains a recording that must not be
                replaced, or files that do not belong to a recording.
        """
        self._files = RecordingFolder(folder)
        self._overwrite = overwrite
        self._files.check(overwrite)
        self._topics = tuple(topics)
        self._start_ns = start_ns
        self._attachments = dict(attachments)
        self._scenario = scenario
        self._beside = {
            self._files.path / name: value
            for name, value in (beside or {}).items()
        }
        self._custom_data = dict(custom_data or {})
        self._fingerprint = fingerprint
        self._is_open = False
        self._counts = {topic.name: 0 for topic in self._topics}
        # Topic -> stamp of its last message; least and greatest stamp of all
        # messages [ns].
        self._latest_ns: dict[str, int] = {}
        self._span_ns: tuple[int, int] | None = None

    def __enter__(self) -> BagWriter:
        """Creates the folder, the MCAP and the records before the messages.

        Raises:
            InputError: if the folder or the file cannot be written, or another
                process is writing it.
        """
        with user_errors(self._files.path):
            self._files.path.mkdir(parents=True, exist_ok=True)
        self._files.check(self._overwrite)
        with contextlib.ExitStack() as stack, user_errors(self._files.mcap):
            stack.callback(self._remove_folder)
            stack.enter_context(sole_writer(self._files.path, "recording"))
            part = stack.enter_context(completing(self._files.mcap))
            self._stream = open(part, "wb")
            stack.callback(self._close_stream)
            self._chunks, self._channel_ids = self._write_preamble()
            self._opened = stack.pop_all()
        self._is_open = True
        return self

    def __exit__(
        self,
        exception_type: type[BaseException] | None,
        exception: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Completes the recording; after an exception, removes it.

        Raises:
            InputError: if the files cannot be completed, e.g. on a full disk;
                nothing is left then.
        """
        self._is_open = False
        if exception_type is not None:
            self._opened.__exit__(exception_type, exception, traceback)
            return
        with self._opened:
            with user_errors(self._files.mcap):
                self._write_ending()
            self._complete_files()

    def write(
        self, topic: str, stamp_ns: int, data: bytes, sequence: int
    ) -> None:
        """Appends one message; on each topic, times must increase.

        Args:
            topic: name of one of the topics.
            stamp_ns: time of the message [ns].
            data: the serialised message.
            sequence: number of the message on its topic.

        Raises:
            InputError: if the file cannot be written, e.g. on a full disk, or
                the message is not later than the last message on its topic.
            RuntimeError: the recording is not open.
        """
        if not self._is_open:
            raise RuntimeError(
                f"{self._files.path}: the recording is not open; simulate "
                "within its `with` block"
            )
        self._check_order(topic, stamp_ns)
        channel_id = self._channel_ids[topic]
        with user_errors(self._files.mcap):
            self._chunks.add_message(channel_id, stamp_ns, data, sequence)
        self._counts[topic] += 1
        self._latest_ns[topic] = stamp_ns
        first_ns, last_ns = self._span_ns or (stamp_ns, stamp_ns)
        self._span_ns = (min(first_ns, stamp_ns), max(last_ns, stamp_ns))

    def _check_order(self, topic: str, stamp_ns: int) -> None:
        """Refuses a message that is not later than the last on its topic."""
        last_ns = self._latest_ns.get(topic, -1)
        if stamp_ns > last_ns:
            return
        message = f"{topic}: a message at {stamp_ns / 1e9:g} s"
        if stamp_ns < 0:
            raise InputError(
                f"{self._files.path}: {message}, before the epoch; begin the "
                "recording with a later start_ns"
            )
        raise InputError(
            f"{self._files.path}: {message} comes after that at "
            f"{last_ns / 1e9:g} s; where a simulator begins again, or its "
            "clock goes back, begin a new recording"
        )

    def _write_preamble(self) -> tuple[_TopicChunks, dict[str, int]]:
        """Writes the records before the messages.

        Returns:
            The writer of messages, and topic -> channel id.
        """
        chunks = _TopicChunks(self._stream)
        writer = chunks.writer
        writer.start(profile="ros2", library=f"cns-drake {__version__}")
        for name, value in self._attachments.items():
            start_ns = self._start_ns
            kind, content = _encode_attachment(name, value)
            writer.add_attachment(start_ns, start_ns, name, kind, content)
        schema_ids: dict[str, int] = {}
        for topic in self._topics:
            kind = topic.message_type
            if kind not in schema_ids:
                text = message_definition(kind).encode()
                schema_ids[kind] = writer.register_schema(kind, "ros2msg", text)
        channel_ids = {
            topic.name: writer.register_channel(
                topic.name,
                "cdr",
                schema_ids[topic.message_type],
                rosbag2_metadata.channel_metadata(topic),
            )
            for topic in self._topics
        }
        writer.flush()
        return chunks, channel_ids

    def _write_ending(self) -> None:
        self._chunks.writer.add_metadata(
            "rosbag2", {"serialized_metadata": to_yaml(self._bag_information())}
        )
        self._chunks.finish({v: k for k, v in self._channel_ids.items()})
        self._stream.flush()
        os.fsync(self._stream.fileno())

    def _complete_files(self) -> None:
        """Writes the remaining files, and gives them their final names.

        All files are whole under temporary names before the first is renamed.
        The MCAP is renamed last, and an old MCAP is removed first: no file may
        describe another MCAP.
        """
        own = self._files
        metadata = {"rosbag2_bagfile_information": self._bag_information()}
        texts = {own.metadata: to_yaml(metadata)}
        texts[own.scenario] = to_yaml(self._scenario)
        texts |= {path: to_yaml(one) for path, one in self._beside.items()}
        if self._fingerprint:
            texts[own.fingerprint] = self._fingerprint
        with contextlib.ExitStack() as stack:
            for path, text in texts.items():
                part = stack.enter_context(completing(path))
                with user_errors(path), part.open("w", encoding="utf-8") as to:
                    to.write(text)
                    to.flush()
                    os.fsync(to.fileno())
            with user_errors(own.path):
                own.mcap.unlink(missing_ok=True)
                own.fingerprint.unlink(missing_ok=True)

    def _close_stream(self) -> None:
        # All data have been flushed, or that has failed already. Closing
        # flushes again and would only repeat the error of a full disk.
        with contextlib.suppress(OSError):
            self._stream.close()

    def _remove_folder(self) -> None:
        """Removes the folder if nothing is in it."""
        with contextlib.suppress(OSError):
            self._files.path.rmdir()

    def _bag_information(self) -> dict:
        """Returns rosbag2's description of the file."""
        first_ns, last_ns = self._span_ns or (self._start_ns, self._start_ns)
        topics = [
            rosbag2_metadata.describe_topic(
                topic.name,
                topic.message_type,
                self._counts[topic.name],
                rosbag2_metadata.channel_metadata(topic),
            )
            for topic in self._topics
        ]
        return rosbag2_metadata.make_bag_information(
            self._files.mcap.name,
            topics,
            start_ns=first_ns,
            end_ns=last_ns,
            custom_data=self._custom_data,
        )


def _encode_attachment(name: str, value: Any) -> tuple[str, bytes]:
    """Returns the media type and the content of an attachment."""
    if name.endswith(".yaml"):
        return "application/yaml", to_yaml(value).encode()
    text = json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False)
    return "application/json", text.encode()


class _TopicChunks:
    """Writes an MCAP file in zstd-compressed chunks that hold one topic each.

    Attributes:
        writer: the writer of all records other than messages.
    """

    def __init__(self, stream: BinaryIO):
        self.writer = Writer(
            stream, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD
        )
        # Channel id -> log time, data and sequence of its messages.
        self._held: dict[int, list[tuple[int, bytes, int]]] = {}
        self._held_bytes = 0
        self._start_ns: int | None = None
        # Channel id -> number of messages with the log time as their stamp.
        self._stamped: Counter[int] = Counter()

    def add_message(
        self, channel_id: int, log_time: int, data: bytes, sequence: int
    ) -> None:
        """Holds a message, after messages of an earlier span were written."""
        if self._start_ns is None:
            self._start_ns = log_time
        if (
            log_time - self._start_ns >= _SPAN_NS
            or self._held_bytes >= _MOST_HELD_BYTES
        ):
            self.flush()
            self._start_ns = log_time
        message = log_time, data, sequence
        self._held.setdefault(channel_id, []).append(message)
        self._held_bytes += len(data)
        self._stamped[channel_id] += read_stamp(data) == log_time

    def flush(self) -> None:
        """Writes all messages that are held."""
        for channel_id, held in self._held.items():
            for log_time, data, sequence in held:
                self.writer.add_message(
                    channel_id, log_time, data, log_time, sequence
                )
            self.writer.flush()
            held.clear()
        self._held_bytes = 0

    def finish(self, topics: Mapping[int, str]) -> None:
        """Completes the file.

        Args:
            topics: channel id -> name of its topic.
        """
        self.flush()
        counts: Counter[str] = Counter()
        for channel_id, count in self._stamped.items():
            counts[topics[channel_id]] += count
        stamped = {
            topic: str(count) for topic, count in counts.items() if count
        }
        if stamped:
            self.writer.add_metadata(STAMPED_RECORD, stamped)
        self.writer.finish()


class RecordingFolder:
    """The files of a recording: a rosbag2 folder with one MCAP file.

    The name of the folder is the name of the recording. `fingerprint.txt`
    contains a hash of everything that determines the recording; see
    `cns_drake.scenarios.provenance`. The MCAP file is completed last, so a
    folder with this file and `metadata.yaml` contains a finished recording.

    Attributes:
        path: the folder, as an absolute path.
        mcap: path of the MCAP file.
        scenario: path of `scenario.yaml`.
        fingerprint: path of `fingerprint.txt`.
        metadata: path of `metadata.yaml`.
    """

    def __init__(self, path: Path):
        self.path = Path(os.path.abspath(path))
        self.mcap = self.path / f"{self.path.name}_0.mcap"
        self.scenario = self.path / "scenario.yaml"
        self.fingerprint = self.path / "fingerprint.txt"
        self.metadata = self.path / "metadata.yaml"

    def is_finished(self) -> bool:
        """Whether the folder contains a finished recording."""
        return self.metadata.is_file() and self.mcap.is_file()

    def files(self) -> tuple[Path, ...]:
        """Returns the paths of all these files."""
        return self.mcap, self.scenario, self.fingerprint, self.metadata

    def check(self, overwrite: bool) -> None:
        """Checks that a recording may be written to the folder.

        Args:
            overwrite: whether the folder may contain anything.

        Raises:
            InputError: the folder cannot be used, contains a recording, or
                contains files, none of which belongs to a recording of this
                name. With `overwrite`, only the first of these faults is an
                error. What a killed run has left is no recording.
        """
        with user_errors(self.path):
            if not self.path.is_dir():
                if self.path.exists():
                    raise InputError(
                        f"{self.path}: a file has this name; give another "
                        "folder"
                    )
                return
            if overwrite:
                return
            if self.mcap.exists():
                raise InputError(
                    f"{self.path}: the folder already exists and holds a "
                    "recording (replace it by --overwrite, in Python"
                    " overwrite=True)"
                )
            found = sorted(self.path.iterdir())
        # The MCAP is completed last, so a killed run has left its draft.
        if found and not any(is_draft_of(one, self.mcap) for one in found):
            raise InputError(
                f"{self.path}: the folder already exists and holds other "
                f"files, such as '{found[0].name}' (--overwrite keeps them and "
                "records beside them)"
            )
