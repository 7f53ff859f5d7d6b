"""Chunks of one topic each: readers see the same messages in the same order."""

import io

from helpers.drive_files import make_scan, write_recording, yaw_pose
from mcap.reader import make_reader
from mcap.writer import Writer
import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from cns_drake.recording import BagWriter, Topic
from evaluation.base import InputError
from evaluation.drives import STAMPED_RECORD, open_drive

FRAMES = 40
CLOUDS = "/lidar/points"


def read(path):
    """The messages of a file by log time: topic, time, content and number."""
    with path.open("rb") as stream:
        return [
            (channel.topic, one.log_time, one.data, one.sequence)
            for _, channel, one in make_reader(
                stream, validate_crcs=True
            ).iter_messages()
        ]


def summary_of(path):
    with path.open("rb") as stream:
        return make_reader(stream).get_summary()


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """A file of an independent writer, in whose chunks topics are mixed."""
    rng = np.random.default_rng(5)
    scans = [make_scan(rng.uniform(-9, 9, (4000, 3))) for _ in range(FRAMES)]
    X_WBs = [yaw_pose(k, 0.1 * k, 0.0, 0.1 * k) for k in range(FRAMES)]
    folder = tmp_path_factory.mktemp("mixed") / "town_01"
    return write_recording(folder, scans, X_WBs, chunk_size=200_000)


def write(folder, written):
    """Records messages; returns the path of the MCAP file."""
    types = {
        CLOUDS: "sensor_msgs/msg/PointCloud2",
        "/odometry": "nav_msgs/msg/Odometry",
        "/tf_static": "tf2_msgs/msg/TFMessage",
    }
    topics = [Topic(name, kind) for name, kind in types.items()]
    with BagWriter(
        folder, topics, start_ns=0, attachments={}, scenario={}
    ) as bag:
        for message in written:
            bag.write(*message)
    return folder / f"{folder.name}_0.mcap"


@pytest.fixture
def sorted_file(mixed, tmp_path):
    return write(tmp_path / "town_01", read(mixed))


def test_a_chunk_holds_one_topic_of_a_short_span(mixed, sorted_file):
    assert any(
        len(chunk.message_index_offsets) > 1
        for chunk in summary_of(mixed).chunk_indexes
    )
    summary = summary_of(sorted_file)
    for chunk in summary.chunk_indexes:
        assert len(chunk.message_index_offsets) == 1
        assert chunk.message_end_time - chunk.message_start_time < 800_000_000
    used = [
        summary.channels[next(iter(chunk.message_index_offsets))].topic
        for chunk in summary.chunk_indexes
    ]
    # 16 frames take 0.8 s.
    assert used.count("/odometry") == 3
    assert used.count(CLOUDS) > 3


def test_readers_keep_the_order_of_messages_of_equal_time(mixed, sorted_file):
    wanted = read(mixed)
    assert len({time for _, time, _, _ in wanted}) < len(wanted) / 2
    assert read(sorted_file) == wanted
    with AnyReader([sorted_file]) as reader:
        found = [
            (connection.topic, time, bytes(data))
            for connection, time, data in reader.messages()
        ]
    assert found == [message[:3] for message in wanted]


def damage_clouds(path, first, last):
    """Flips a bit in chunks of clouds, numbered from 0."""
    summary = summary_of(path)
    data = bytearray(path.read_bytes())
    chunks = [
        chunk
        for chunk in summary.chunk_indexes
        if summary.channels[next(iter(chunk.message_index_offsets))].topic
        == CLOUDS
    ]
    for chunk in chunks[first:last]:
        data[chunk.chunk_start_offset + 1000] ^= 1
    path.write_bytes(data)
    return len(chunks)


def test_poses_are_read_without_the_clouds(mixed, sorted_file):
    wanted = open_drive(mixed)
    assert damage_clouds(sorted_file, 1, -1) > 3
    drive = open_drive(sorted_file)
    assert len(drive) == FRAMES
    np.testing.assert_array_equal(drive.stamps_ns, wanted.stamps_ns)
    np.testing.assert_array_equal(drive.X_WS, wanted.X_WS)
    assert drive.odometry.tobytes() == wanted.odometry.tobytes()
    np.testing.assert_array_equal(drive.motion[1], wanted.motion[1])
    with pytest.raises(InputError, match="checksum of a chunk"):
        drive.scan(FRAMES // 2)


def test_scans_are_the_same(mixed, sorted_file):
    wanted, drive = open_drive(mixed), open_drive(sorted_file)
    for i in range(FRAMES):
        np.testing.assert_array_equal(drive.scan(i), wanted.scan(i))


@pytest.mark.parametrize("late", [[0], [FRAMES // 2], range(FRAMES)])
def test_log_times_that_are_no_stamps(mixed, tmp_path, late):
    wanted = open_drive(mixed)
    times = dict.fromkeys(wanted.stamps_ns[list(late)].tolist(), 7_000_000)
    path = write(
        tmp_path / "town_01",
        [
            (topic, time + times.get(time, 0), data, number)
            for topic, time, data, number in read(mixed)
            if topic == CLOUDS
        ]
        + [one for one in read(mixed) if one[0] != CLOUDS],
    )
    drive = open_drive(path)
    np.testing.assert_array_equal(drive.stamps_ns, wanted.stamps_ns)
    np.testing.assert_array_equal(drive.X_WS, wanted.X_WS)


def state_stamps(path, **changes):
    """Rewrites a file that states that all its log times are stamps."""
    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start()
    counts = {}
    with path.open("rb") as source:
        channels = {}
        for schema, channel, one in make_reader(source).iter_messages():
            topic = channel.topic
            if topic not in channels:
                kind = writer.register_schema(
                    schema.name, schema.encoding, schema.data
                )
                channels[topic] = writer.register_channel(topic, "cdr", kind)
            number = counts.get(topic, 0)
            later = number in changes.get("later", ()) and topic == CLOUDS
            writer.add_message(
                channels[topic], one.log_time + later, one.data, one.log_time
            )
            counts[topic] = number + 1
    counts[CLOUDS] += changes.get("more", 0)
    for _ in range(changes.get("records", 1)):
        writer.add_metadata(STAMPED_RECORD, {k: str(counts[k]) for k in counts})
    writer.finish()
    path.write_bytes(stream.getvalue())


@pytest.fixture
def stated(mixed, tmp_path):
    path = tmp_path / "town_01.mcap"
    path.write_bytes(mixed.read_bytes())
    return path


@pytest.mark.parametrize(
    "changes",
    [
        {"later": [0]},
        {"later": [FRAMES - 1]},
        # After a program has joined or cut files, the numbers are others.
        {"later": [3], "more": 1},
        {"later": [3], "more": -1},
        {"later": [3], "records": 2},
    ],
)
def test_a_false_statement_on_stamps_is_not_believed(mixed, stated, changes):
    state_stamps(stated, **changes)
    wanted = open_drive(mixed).stamps_ns
    np.testing.assert_array_equal(open_drive(stated).stamps_ns, wanted)


def test_a_scan_that_contradicts_the_statement_is_refused(stated):
    state_stamps(stated, later=[3])
    drive = open_drive(stated)
    drive.scan(2)
    with pytest.raises(InputError, match=r"scan 3 at .* its log time is"):
        drive.scan(3)


def test_frames_of_scans_are_checked_where_they_are_read(mixed, tmp_path):
    def turn(topic, time, data, number):
        if topic == CLOUDS and number == 5:
            data = data.replace(b"lidar\0", b"other\0", 1)
        return topic, time, data, number

    path = write(tmp_path / "town_01", [turn(*one) for one in read(mixed)])
    drive = open_drive(path)
    drive.scan(4)
    with pytest.raises(InputError, match=r"scan 5 .*in frame 'other'"):
        drive.scan(5)
