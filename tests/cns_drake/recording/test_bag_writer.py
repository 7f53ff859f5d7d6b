import contextlib
import json
import os
import re
import resource

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability, QosReliability
import yaml

from cns_drake.recording import BagWriter, Topic
from evaluation.base import InputError
from evaluation.drives import ODOMETRY, TF, make_message, serialize

START_NS = 1_700_000_000_000_000_000
SCENARIO = {"map": "town", "stage": 1, "pair": [[1, 2], [1, 2]]}
ATTACHMENTS = {
    "scenario.json": SCENARIO,
    "instances.json": [
        {"instance": 1, "name": "café_01", "class": "building", "label": 50}
    ],
}
TOPICS = (
    Topic("/tf", TF),
    Topic("/odometry", ODOMETRY),
    Topic("/tf_static", TF, latched=True),
)
EMPTY_TF = serialize(make_message(TF, transforms=[]))


def open_bag(folder, **kwargs):
    return BagWriter(
        folder,
        TOPICS,
        start_ns=START_NS,
        attachments=ATTACHMENTS,
        scenario=SCENARIO,
        **kwargs,
    )


def write_frames(bag, frames, data=EMPTY_TF):
    for i in frames:
        bag.write("/tf", START_NS + i * 50_000_000, data, i)


def record(folder, num_frames=50, **kwargs):
    with open_bag(folder, **kwargs) as bag:
        bag.write("/tf_static", START_NS, EMPTY_TF, 0)
        write_frames(bag, range(num_frames))


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def stamps_read_indexed(path):
    with open(path, "rb") as stream:
        return [m.log_time for _, _, m in make_reader(stream).iter_messages()]


def stamps_read_linearly(path):
    """Reads a file without an end up to its last message."""
    stamps = []
    with open(path, "rb") as stream, contextlib.suppress(McapError):
        for record in StreamReader(stream, emit_chunks=False).records:
            if isinstance(record, Message):
                stamps.append(record.log_time)
    return stamps


class InterruptionError(Exception):
    pass


def record_and_interrupt(folder, num_frames, **kwargs):
    with open_bag(folder, **kwargs) as bag:
        write_frames(bag, range(num_frames))
        raise InterruptionError


def test_folder_has_the_files_of_a_rosbag2(tmp_path):
    record(tmp_path / "deep" / "town_01")
    assert names(tmp_path / "deep" / "town_01") == [
        "metadata.yaml",
        "scenario.yaml",
        "town_01_0.mcap",
    ]


def test_nothing_has_a_final_name_while_recording(tmp_path):
    folder = tmp_path / "town_01"
    with open_bag(folder) as bag:
        write_frames(bag, range(30))
        (draft,) = names(folder)
        assert re.fullmatch(r"\.town_01_0\.mcap\.[0-9a-f]{32}\.part", draft)


@pytest.mark.parametrize("bare", [False, True])
def test_rosbags_reads_folder_and_bare_file(tmp_path, bare):
    folder = tmp_path / "town_01"
    record(folder)
    path = folder / "town_01_0.mcap" if bare else folder
    with AnyReader([path]) as reader:
        assert reader.message_count == 51
        assert reader.start_time == START_NS
        counts = {c.topic: c.msgcount for c in reader.connections}
        assert counts["/tf"] == 50
        assert counts["/tf_static"] == 1
        durability = {
            c.topic: c.ext.offered_qos_profiles[0].durability
            for c in reader.connections
        }
        assert durability["/tf_static"] == QosDurability.TRANSIENT_LOCAL
        assert durability["/tf"] == QosDurability.VOLATILE
        assert all(
            c.ext.offered_qos_profiles[0].reliability == QosReliability.RELIABLE
            for c in reader.connections
        )
        stamps = [
            stamp
            for connection, stamp, _ in reader.messages()
            if connection.topic == "/tf"
        ]
    assert stamps == [START_NS + i * 50_000_000 for i in range(50)]


def test_metadata_is_version_8_and_has_no_aliases(tmp_path):
    record(tmp_path / "town_01", custom_data={"map": "town"})
    text = (tmp_path / "town_01" / "metadata.yaml").read_text()
    assert "&" not in text
    assert "*" not in text
    information = yaml.safe_load(text)["rosbag2_bagfile_information"]
    assert information["version"] == 8
    assert information["storage_identifier"] == "mcap"
    assert information["message_count"] == 51
    assert information["duration"]["nanoseconds"] == 49 * 50_000_000
    assert information["starting_time"] == {"nanoseconds_since_epoch": START_NS}
    assert information["relative_file_paths"] == ["town_01_0.mcap"]
    assert information["custom_data"] == {"map": "town"}
    topics = {
        entry["topic_metadata"]["name"]: entry
        for entry in information["topics_with_message_count"]
    }
    assert topics["/tf"]["message_count"] == 50
    assert topics["/odometry"]["message_count"] == 0
    static = topics["/tf_static"]["topic_metadata"]
    assert static["type_description_hash"].startswith("RIHS01_")
    # A string that is YAML itself; version 9 would have a list here.
    assert isinstance(static["offered_qos_profiles"], str)
    profile = yaml.safe_load(static["offered_qos_profiles"])[0]
    assert profile["history"] == 1
    assert profile["reliability"] == 1
    assert profile["durability"] == 1
    assert profile["liveliness"] == 1
    assert profile["depth"] == 1


def test_span_covers_topics_that_are_written_one_after_the_other(tmp_path):
    with open_bag(tmp_path / "town_01") as bag:
        bag.write("/tf", START_NS + 10, EMPTY_TF, 0)
        bag.write("/odometry", START_NS + 5, EMPTY_TF, 0)
    text = (tmp_path / "town_01" / "metadata.yaml").read_text()
    information = yaml.safe_load(text)["rosbag2_bagfile_information"]
    start = {"nanoseconds_since_epoch": START_NS + 5}
    assert information["starting_time"] == start
    assert information["duration"] == {"nanoseconds": 5}


def test_mcap_follows_the_ros2_profile(tmp_path):
    record(tmp_path / "town_01")
    with open(tmp_path / "town_01" / "town_01_0.mcap", "rb") as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        attachments = {a.name: a for a in reader.iter_attachments()}
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
    for channel in summary.channels.values():
        assert channel.message_encoding == "cdr"
        profile = yaml.safe_load(channel.metadata["offered_qos_profiles"])[0]
        latched = channel.topic == "/tf_static"
        assert profile["durability"] == (1 if latched else 2)
        assert channel.metadata["topic_type_hash"].startswith("RIHS01_")
    assert {s.encoding for s in summary.schemas.values()} == {"ros2msg"}
    assert {s.name for s in summary.schemas.values()} == {
        "tf2_msgs/msg/TFMessage",
        "nav_msgs/msg/Odometry",
    }
    assert {i.compression for i in summary.chunk_indexes} == {"zstd"}
    for name, value in ATTACHMENTS.items():
        assert attachments[name].media_type == "application/json"
        assert json.loads(attachments[name].data) == value
    information = yaml.safe_load(metadata["rosbag2"]["serialized_metadata"])
    assert information["version"] == 8
    assert information["message_count"] == 51


def test_scenario_lies_beside_the_recording(tmp_path):
    record(tmp_path / "town_01")
    text = (tmp_path / "town_01" / "scenario.yaml").read_text()
    assert yaml.safe_load(text) == SCENARIO


def test_same_calls_give_same_bytes(tmp_path):
    for parent in ("a", "b"):
        record(tmp_path / parent / "town_01")
    for name in names(tmp_path / "a" / "town_01"):
        a, b = (tmp_path / p / "town_01" / name for p in ("a", "b"))
        assert a.read_bytes() == b.read_bytes()


def test_four_fifths_of_a_second_reach_the_operating_system(tmp_path):
    folder = tmp_path / "town_01"
    with open_bag(folder) as bag:
        write_frames(bag, range(17))
        (draft,) = folder.iterdir()
        stamps = stamps_read_linearly(draft)
    assert stamps == [START_NS + i * 50_000_000 for i in range(16)]


def test_existing_folder_is_refused_and_untouched(tmp_path):
    folder = tmp_path / "town_01"
    record(folder, 5)
    before = {n: (folder / n).read_bytes() for n in names(folder)}
    with pytest.raises(InputError, match=r"town_01: .*exists") as error:
        open_bag(folder)
    assert "\n" not in str(error.value)
    assert {n: (folder / n).read_bytes() for n in names(folder)} == before


def test_recording_that_appears_after_the_check_is_refused(tmp_path):
    folder = tmp_path / "town_01"
    bag = open_bag(folder)
    record(folder, 5)
    with pytest.raises(InputError, match=r"town_01: .*exists"), bag:
        pytest.fail("the context must not open")
    assert len(stamps_read_indexed(folder / "town_01_0.mcap")) == 6


def test_overwrite_keeps_the_old_recording_until_the_new_is_whole(tmp_path):
    folder = tmp_path / "town_01"
    record(folder, 5)
    with open_bag(folder, overwrite=True) as bag:
        write_frames(bag, range(7))
        assert len(stamps_read_indexed(folder / "town_01_0.mcap")) == 6
    assert len(stamps_read_indexed(folder / "town_01_0.mcap")) == 7
    information = yaml.safe_load((folder / "metadata.yaml").read_text())
    assert information["rosbag2_bagfile_information"]["message_count"] == 7
    assert not [name for name in names(folder) if name.endswith(".part")]


def test_overwrite_that_fails_keeps_the_old_recording(tmp_path):
    folder = tmp_path / "town_01"
    record(folder, 5)
    before = {n: (folder / n).read_bytes() for n in names(folder)}
    with pytest.raises(InterruptionError):
        record_and_interrupt(folder, 30, overwrite=True)
    assert {n: (folder / n).read_bytes() for n in names(folder)} == before


def test_overwrite_needs_no_old_recording(tmp_path):
    record(tmp_path / "town_01", 5, overwrite=True)
    assert len(stamps_read_indexed(tmp_path / "town_01/town_01_0.mcap")) == 6


def test_folder_below_a_file_is_named(tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(InputError, match="town_01: Not a directory"):
        record(file / "town_01")


@pytest.mark.parametrize("overwrite", [False, True])
def test_file_in_place_of_the_folder_is_refused(tmp_path, overwrite):
    (tmp_path / "town_01").write_text("precious")
    with pytest.raises(InputError, match="town_01: a file has this name"):
        open_bag(tmp_path / "town_01", overwrite=overwrite)


@contextlib.contextmanager
def largest_file(size):
    """Makes real writes fail, without a mount."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_full_disk_at_the_start(tmp_path):
    folder = tmp_path / "town_01"
    with (
        largest_file(10),
        pytest.raises(InputError, match=r"\.mcap: File too large") as error,
    ):
        record(folder)
    assert "\n" not in str(error.value)
    assert not folder.exists()
    record(folder)
    assert "metadata.yaml" in names(folder)


def test_disk_that_fills_up_in_mid_run(tmp_path):
    folder = tmp_path / "town_01"
    noise = np.random.default_rng(0)

    def record_much():
        with open_bag(folder) as bag:
            for i in range(100):
                write_frames(bag, [i], noise.bytes(100_000))

    with (
        largest_file(3_000_000),
        pytest.raises(InputError, match=r"\.mcap: File too large"),
    ):
        record_much()
    assert not folder.exists()


def test_disk_that_fills_up_at_the_very_end(tmp_path, monkeypatch):
    folder = tmp_path / "town_01"
    record(folder, 5)
    before = {n: (folder / n).read_bytes() for n in names(folder)}

    def fail(descriptor):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(InputError, match=r"\.mcap: No space left"):
        record(folder, 9, overwrite=True)
    assert {n: (folder / n).read_bytes() for n in before} == before
