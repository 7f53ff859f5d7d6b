"""Writing a rosbag2 folder with one MCAP file, so that it can be trusted.

The recording grows in `<folder>/<name>_0.mcap.part`. Only when it is whole
does it get its final name, and `metadata.yaml` comes last: where that file
is, the folder is complete and consistent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import contextlib
import json
import os
from pathlib import Path

from mcap.writer import CompressionType, Writer

from cns_drake import __version__, messages
from cns_drake.errors import InputError
from cns_drake.files import (
    complete_part,
    part_path,
    user_errors,
    write_part,
)
from cns_drake.rosbag2_metadata import (
    Topic,
    make_bag_information,
    make_qos_yaml,
    to_yaml,
)

_CHUNK_BYTES = 1024 * 1024
# A chunk that is not closed is lost when the process is killed. Without a
# LiDAR a chunk of 1 MiB lasts for many seconds, hence the flush by time.
_FLUSH_PERIOD_NS = 1_000_000_000


class BagWriter:
    """A context manager that writes one recording.

    Leaving the context normally completes the recording. Leaving it by an
    exception closes what was recorded as a shorter but valid MCAP file that
    keeps its `.part` name. The same calls give the same bytes.
    """

    def __init__(
        self,
        folder: Path,
        topics: Sequence[Topic],
        *,
        start_ns: int,
        attachments: Mapping[str, object],
        scenario: Mapping[str, object],
        custom_data: Mapping[str, str] | None = None,
        overwrite: bool = False,
    ):
        """Checks the target; nothing is written before the context opens.

        Args:
            folder: the rosbag2 folder; its last part names the recording.
            topics: every topic, in the order of the file's channels.
            start_ns: time of the first message, also the nominal time of
                the attachments [ns].
            attachments: file name -> JSON value, put before all messages.
            scenario: what `scenario.yaml` beside the MCAP shall hold.
            custom_data: key -> text for `ros2 bag info`.
            overwrite: whether an existing recording may be replaced. It is
                kept until the new one is complete.

        Raises:
            InputError: if the folder exists and `overwrite` is not set.
        """
        self._folder = Path(os.path.abspath(folder))
        self._overwrite = overwrite
        check_folder(self._folder, overwrite)
        self._topics = tuple(topics)
        self._start_ns = start_ns
        self._attachments = dict(attachments)
        self._scenario = scenario
        self._custom_data = dict(custom_data or {})
        self._mcap = self._folder / f"{self._folder.name}_0.mcap"
        self._part = part_path(self._mcap)
        self._counts = {topic.name: 0 for topic in self._topics}
        self._first_ns: int | None = None
        self._last_ns: int | None = None
        self._flushed_ns = start_ns
        # False while a record is being written: if that is interrupted, the
        # writer's index no longer describes the file and must not be used.
        self._intact = True

    def __enter__(self) -> BagWriter:
        """Creates the folder, the MCAP and what precedes the messages.

        Raises:
            InputError: if the folder or the file cannot be written.
        """
        with user_errors(self._folder):
            self._folder.mkdir(parents=True, exist_ok=self._overwrite)
        with user_errors(self._part):
            self._stream = open(self._part, "wb")
        try:
            with self._writing():
                self._begin()
        except BaseException:
            self._close_part()
            raise
        return self

    def __exit__(self, exception_type, exception, traceback) -> None:
        """Completes the recording, or closes the part of it that exists.

        Raises:
            InputError: if the files cannot be completed, e.g. on a full
                disk; nothing has got a final name then.
        """
        if exception_type is not None:
            self._close_part()
            return
        try:
            with self._writing():
                self._end()
                os.fsync(self._stream.fileno())
        finally:
            self._close_stream()
        self._publish()

    def write(
        self, topic: str, stamp_ns: int, data: bytes, sequence: int
    ) -> None:
        """Appends one message; messages must come in the order of time.

        Args:
            topic: name of one of the topics.
            stamp_ns: the message's time [ns].
            data: the serialised message.
            sequence: the message's number on its topic.

        Raises:
            InputError: if the file cannot be written, e.g. on a full disk.
        """
        channel_id = self._channel_ids[topic]
        with self._writing():
            if stamp_ns - self._flushed_ns >= _FLUSH_PERIOD_NS:
                self._writer.flush()
                self._flushed_ns = stamp_ns
            self._writer.add_message(
                channel_id, stamp_ns, data, stamp_ns, sequence
            )
        self._counts[topic] += 1
        if self._first_ns is None:
            self._first_ns = stamp_ns
        self._last_ns = stamp_ns

    def _begin(self) -> None:
        self._writer = Writer(
            self._stream,
            chunk_size=_CHUNK_BYTES,
            compression=CompressionType.ZSTD,
        )
        self._writer.start(profile="ros2", library=f"cns-drake {__version__}")
        for name, value in self._attachments.items():
            self._writer.add_attachment(
                self._start_ns,
                self._start_ns,
                name,
                "application/json",
                _to_json(value),
            )
        schema_ids = {
            message_type: self._writer.register_schema(
                message_type,
                "ros2msg",
                messages.message_definition(message_type).encode(),
            )
            for message_type in dict.fromkeys(
                topic.message_type for topic in self._topics
            )
        }
        self._channel_ids = {
            topic.name: self._writer.register_channel(
                topic.name,
                "cdr",
                schema_ids[topic.message_type],
                {
                    "offered_qos_profiles": make_qos_yaml(topic),
                    "topic_type_hash": messages.message_hash(
                        topic.message_type
                    ),
                },
            )
            for topic in self._topics
        }
        self._writer.flush()

    def _end(self) -> None:
        self._writer.add_metadata(
            "rosbag2", {"serialized_metadata": to_yaml(self._information())}
        )
        self._writer.finish()
        self._stream.flush()

    def _publish(self) -> None:
        """Gives the finished files their final names, `metadata.yaml` last.

        All files are whole under their `.part` names before the first is
        renamed. An old `metadata.yaml` goes first: it must never describe
        the new MCAP.
        """
        metadata_file = self._folder / "metadata.yaml"
        scenario_file = self._folder / "scenario.yaml"
        metadata = {"rosbag2_bagfile_information": self._information()}
        write_part(scenario_file, to_yaml(self._scenario))
        write_part(metadata_file, to_yaml(metadata))
        with user_errors(metadata_file):
            metadata_file.unlink(missing_ok=True)
        for path in (self._mcap, scenario_file, metadata_file):
            complete_part(path)

    def _close_part(self) -> None:
        """Ends an incomplete file as well as its state allows."""
        # The exception on its way is the fault to report, not a second one
        # that comes of it.
        with contextlib.suppress(InputError):
            if self._intact:
                with self._writing():
                    self._end()
        self._close_stream()

    def _close_stream(self) -> None:
        # Whatever mattered has been flushed or has failed already; closing
        # flushes again and, on a full disk, would only repeat the error.
        with contextlib.suppress(OSError):
            self._stream.close()

    @contextlib.contextmanager
    def _writing(self):
        self._intact = False
        with user_errors(self._part):
            yield
        self._intact = True

    def _information(self) -> dict:
        """Returns rosbag2's description of the file."""
        first_ns = self._start_ns if self._first_ns is None else self._first_ns
        last_ns = first_ns if self._last_ns is None else self._last_ns
        return make_bag_information(
            self._mcap.name,
            {topic: self._counts[topic.name] for topic in self._topics},
            start_ns=first_ns,
            end_ns=last_ns,
            custom_data=self._custom_data,
        )


def check_folder(folder: Path, overwrite: bool) -> None:
    """Refuses a folder that a recording must not go into.

    Raises:
        InputError: if `folder` is a file, or exists without `overwrite`.
    """
    with user_errors(folder):
        if folder.is_dir():
            if not overwrite:
                raise InputError(
                    f"{folder}: the folder already exists (--overwrite"
                    " replaces it)"
                )
        elif folder.exists():
            raise InputError(f"{folder}: there is a file of this name")


def _to_json(value) -> bytes:
    text = json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False)
    return text.encode()
