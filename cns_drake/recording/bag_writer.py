"""Writes a rosbag2 folder with one MCAP file that survives interruptions.

The recording grows in `<folder>/<name>_0.mcap.part`. The file gets its final
name when it is complete, and `metadata.yaml` is written last. A folder with
`metadata.yaml` is therefore complete and consistent.

An interrupted run leaves a part file. A later run of the same recording takes
over the messages in this file by writing them again; see
`cns_drake.recording.part_file.PartFile`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
import contextlib
import io
import json
import os
from pathlib import Path
from typing import Any, NamedTuple

from cns_drake.base.complete_files import (
    complete_part,
    part_path,
    write_part,
)
from cns_drake.base.errors import InputError
from cns_drake.base.files import user_errors
from cns_drake.base.version import __version__
from cns_drake.drives import ros_types
from cns_drake.recording import rosbag2_metadata
from cns_drake.recording.part_file import PartFile
from cns_drake.recording.recording_folder import RecordingFolder
from cns_drake.recording.rosbag2_metadata import Topic, to_yaml
from cns_drake.recording.topic_chunks import TopicChunks, messages_by_time


class RecordedMessage(NamedTuple):
    """A message of a recording.

    Attributes:
        topic: name of the message's topic.
        stamp_ns: time of the message [ns].
        data: the serialised message.
        sequence: number of the message on its topic.
    """

    topic: str
    stamp_ns: int
    data: bytes
    sequence: int


class BagWriter:
    """A context manager that writes one recording as a rosbag2 folder.

    Leaving the context normally completes the recording. Leaving the context by
    an exception closes the file as an incomplete but valid MCAP file under its
    `.part` name. The same calls always produce the same bytes, even if a run
    was interrupted and another run continued the recording.

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
                otherwise as JSON. An interrupted recording can be continued
                only with the same attachments.
            scenario: the content of `scenario.yaml`, next to the MCAP file.
            beside: name -> content of further YAML files next to the MCAP file.
            custom_data: key -> text for `ros2 bag info`.
            fingerprint: the content of `fingerprint.txt`; no file if empty. An
                interrupted recording can be continued only with the same
                fingerprint.
            overwrite: whether an existing recording may be replaced. A finished
                recording stays until the new one is complete.

        Raises:
            InputError: if the folder contains a finished recording that must
                not be replaced, or files that do not belong to a recording.
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
        self._part = part_path(self._files.mcap)
        self._latched = {topic.name for topic in topics if topic.latched}
        self._is_open = False
        self._counts = {topic.name: 0 for topic in self._topics}
        # Topic -> stamp of its last message; least and greatest stamp of all
        # messages [ns].
        self._latest_ns: dict[str, int] = {}
        self._span_ns: tuple[int, int] | None = None
        # Whether the writer's index describes the file: False while a record is
        # being written, and after an error that interrupted the writing.
        self._intact = False

    def __enter__(self) -> BagWriter:
        """Creates the folder, the MCAP and the records before the messages.

        Raises:
            InputError: if the folder or the file cannot be written, another
                process is writing it, or the part file of an interrupted run
                belongs to another recording.
        """
        with user_errors(self._files.path):
            self._files.path.mkdir(parents=True, exist_ok=True)
        self._files.check(self._overwrite)
        with user_errors(self._part):
            self._stream = self._open_part()
        try:
            with self._writing():
                self._chunks, self._channel_ids = self._write_preamble(
                    self._stream
                )
        except BaseException:
            self._close_part()
            raise
        self._is_open = True
        return self

    def __exit__(self, exception_type: type | None, *_: object) -> None:
        """Completes the recording, or closes it as a part file.

        Raises:
            InputError: if the files cannot be completed, e.g. on a full disk;
                no file has its final name then.
        """
        self._is_open = False
        if exception_type is not None:
            self._close_part()
            return
        try:
            with self._writing():
                self._write_ending()
                self._stream.finish()
            self._complete_files()
        finally:
            self._close_stream()

    def follows_interruption(self) -> bool:
        """Whether messages of an interrupted run can be taken over now.

        This is possible only before any other message is written.
        """
        return self._stream.replaying

    def interrupted(self) -> Iterator[RecordedMessage]:
        """Yields the messages that an interrupted run recorded.

        To take over these messages, write each message as soon as it is
        yielded, before any other message. The iterator ends where the file is
        damaged.

        Raises:
            InputError: if the file cannot be read.
        """
        with user_errors(self._part), open(self._part, "rb") as stream:
            for topic, message in messages_by_time(stream):
                yield RecordedMessage(
                    topic, message.log_time, message.data, message.sequence
                )

    def write(
        self, topic: str, stamp_ns: int, data: bytes, sequence: int
    ) -> None:
        """Appends one message; on each topic, times must increase.

        The message of a latched topic is skipped if it has already been taken
        over from an interrupted run.

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
        if topic in self._latched and topic in self._latest_ns:
            return
        self._check_order(topic, stamp_ns)
        channel_id = self._channel_ids[topic]
        with self._writing():
            self._chunks.add_message(
                channel_id, stamp_ns, data, stamp_ns, sequence
            )
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

    def _open_part(self) -> PartFile:
        """Opens the part file, empty or with messages to take over."""
        preamble = io.BytesIO()
        self._write_preamble(preamble)
        if (
            self._files.mcap.is_file()
            and not self._files.is_finished()
            and not self._part.exists()
        ):
            # The earlier run was interrupted while it renamed the files.
            with contextlib.closing(PartFile(self._files.mcap)) as stream:
                if self._continues(stream, preamble):
                    os.replace(self._files.mcap, self._part)
                else:
                    self._refuse_other_recording()
        stream = PartFile(self._part)
        try:
            if not self._continues(stream, preamble):
                self._refuse_other_recording()
                stream.clear()
            if self._fingerprint:
                write_part(self._files.fingerprint, self._fingerprint)
        except BaseException:
            stream.close()
            raise
        return stream

    def _continues(self, stream: PartFile, preamble: io.BytesIO) -> bool:
        """Returns whether this recording can continue a file.

        The result is True if the file is empty, because no run has begun it. A
        file with content must have the fingerprint of this recording, and begin
        with the same records.

        Args:
            stream: the file.
            preamble: the records before the messages of this recording.
        """
        if not stream.replaying:
            return True
        found = ""
        path = self._files.fingerprint
        # The part file belongs to the interrupted run. The file with the final
        # name may still belong to a finished recording that is being replaced.
        if part_path(path).is_file():
            path = part_path(path)
        if path.is_file():
            found = path.read_text(encoding="utf-8", errors="replace")
        return found == self._fingerprint and stream.starts_like(
            preamble.getvalue()
        )

    def _refuse_other_recording(self) -> None:
        if not self._overwrite:
            raise InputError(
                f"{self._files.path}: the folder already exists and holds an "
                "interrupted recording of another scenario, world or program "
                "(--overwrite discards it)"
            )

    def _write_preamble(
        self, stream: io.BytesIO | PartFile
    ) -> tuple[TopicChunks, dict[str, int]]:
        """Writes the records before the messages.

        Returns:
            The writer of messages, and topic -> channel id.
        """
        chunks = TopicChunks(stream)
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
                text = ros_types.message_definition(kind).encode()
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

    def _complete_files(self) -> None:
        """Writes the remaining files, and gives all files their final names.

        All files are whole under their `.part` names before the first is
        renamed; `metadata.yaml` is renamed last. Old files that describe the
        MCAP are removed first: they must never describe the new MCAP.
        """
        own = self._files
        metadata = {"rosbag2_bagfile_information": self._bag_information()}
        write_part(own.scenario, to_yaml(self._scenario))
        write_part(own.metadata, to_yaml(metadata))
        for path, value in self._beside.items():
            write_part(path, to_yaml(value))
        with user_errors(own.path):
            own.metadata.unlink(missing_ok=True)
            own.fingerprint.unlink(missing_ok=True)
        complete_part(own.mcap)
        for path in (*self._beside, own.scenario):
            complete_part(path)
        if self._fingerprint:
            complete_part(own.fingerprint)
        complete_part(own.metadata)

    def _close_part(self) -> None:
        """Closes an incomplete file, as a valid MCAP file where possible."""
        # The first exception is the one to report, not a second one that
        # follows from it. If nothing new was written, the file stays as it is.
        with contextlib.suppress(InputError):
            if self._intact and not self._stream.replaying:
                with self._writing():
                    self._write_ending()
        self._close_stream()

    def _close_stream(self) -> None:
        # All data have been flushed, or that has failed already. Closing
        # flushes again and would only repeat the error of a full disk.
        with contextlib.suppress(OSError):
            self._stream.close()

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        """Sets `_intact` to False until the context ends without an error."""
        self._intact = False
        with user_errors(self._part):
            yield
        self._intact = True

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
