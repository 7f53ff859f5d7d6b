"""MCAP files without what the format leaves to the writer, and cut ones."""

import io

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.mcap_bytes import edit_summary
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import open_drive

NUM = 6
ATTACHMENTS = {"scenario.json": {"map": "town", "stage": "02"}}


def record(folder, **options):
    rng = np.random.default_rng(3)
    scans = [make_scan(rng.uniform(-9.0, 9.0, (40, 3))) for _ in range(NUM)]
    X_WBs = [yaw_pose(2.0 * k, 0.0, 0.0, 0.1 * k) for k in range(NUM)]
    options = {"chunk_size": 4000, "attachments": ATTACHMENTS} | options
    return write_recording(folder / "s", scans, X_WBs, **options)


def everything(path):
    drive = open_drive(path)
    assert drive.notes == ()
    return (
        [scan.tobytes() for scan in drive],
        drive.X_WS.tolist(),
        drive.odometry.tobytes(),
        drive.scenario,
    )


@pytest.mark.parametrize(
    "options",
    [
        {"index_types": IndexType.NONE},
        {"index_types": IndexType.CHUNK},
        {"index_types": IndexType.MESSAGE},
        {"index_types": IndexType.CHUNK, "use_statistics": False},
        {"index_types": IndexType.ATTACHMENT},
        {"use_statistics": False},
        {"repeat_channels": False},
        {"repeat_schemas": False},
        {"use_summary_offsets": False},
        {"use_chunking": False},
        {"use_chunking": False, "use_statistics": False},
        {
            "index_types": IndexType.NONE,
            "use_statistics": False,
            "repeat_channels": False,
            "repeat_schemas": False,
            "use_summary_offsets": False,
        },
        {"enable_crcs": False, "index_types": IndexType.CHUNK},
        {"compression": CompressionType.NONE, "index_types": IndexType.NONE},
        {"compression": CompressionType.LZ4, "index_types": IndexType.NONE},
    ],
)
def test_writers_leave_records_out(tmp_path, options):
    wanted = everything(record(tmp_path / "whole"))
    assert everything(record(tmp_path / "bare", **options)) == wanted


def drop_some_message_indexes(summary):
    summary.chunk_indexes[1].message_index_offsets.clear()


def drop_one_message_index(summary):
    offsets = summary.chunk_indexes[1].message_index_offsets
    del offsets[max(offsets)]


def drop_a_chunk_index(summary):
    del summary.chunk_indexes[1]


def drop_attachments(summary):
    summary.attachment_indexes.clear()


def drop_a_schema(summary):
    del summary.schemas[min(summary.schemas)]


def drop_counts(summary):
    summary.statistics.channel_message_counts.clear()


@pytest.mark.parametrize("counted", [True, False])
@pytest.mark.parametrize(
    "change",
    [
        drop_some_message_indexes,
        drop_one_message_index,
        drop_a_chunk_index,
        drop_attachments,
        drop_a_schema,
        drop_counts,
    ],
)
def test_part_of_a_summary(tmp_path, change, counted):
    path = record(tmp_path)
    wanted = everything(path)

    def forget(summary):
        change(summary)
        if not counted:
            summary.statistics = None

    edit_summary(path, forget)
    assert everything(path) == wanted


def test_messages_that_are_counted_but_not_there(tmp_path):
    path = record(tmp_path)

    def boast(summary):
        summary.statistics.message_count += 1

    edit_summary(path, boast)
    with pytest.raises(InputError, match=r"13 of 14 messages .*mcap recover"):
        open_drive(path)


@pytest.mark.parametrize("use_chunking", [False, True])
def test_a_recording_that_was_cut_off(tmp_path, use_chunking):
    data = record(tmp_path, use_chunking=use_chunking).read_bytes()
    # The oracle is the reader of the `mcap` package.
    ends = {}
    stream = io.BytesIO(data)
    for _ in StreamReader(stream, emit_chunks=True).records:
        ends[stream.tell()] = None
    cut = tmp_path / "cut.mcap"
    for size in range(100, len(data) - 40, 997):
        cut.write_bytes(data[:size])
        intact = max((end for end in ends if end <= size), default=8)
        with pytest.raises(
            InputError,
            match=rf"intact up to byte {intact} of {size} \(mcap recover IN -o",
        ) as error:
            open_drive(cut)
        assert "\n" not in str(error.value)
