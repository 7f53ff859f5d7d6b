"""Recordings whose valid parts contradict each other are refused."""

import subprocess
import sys

from helpers import bent_drive
from helpers.contradictions import CONTRADICTIONS, read_messages, write_messages
from helpers.mcap_bytes import edit_summary
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.drives import open_drive


@pytest.fixture
def recording(tmp_path):
    """Path of a recording, and its content."""
    bent_drive.write_drive(tmp_path / "town_07")
    path = tmp_path / "town_07" / "town_07_0.mcap"
    return path, *read_messages(path.read_bytes())


def read_all(path):
    drive = open_drive(path)
    return (
        drive.X_WS.tolist(),
        drive.odometry.tobytes(),
        [scan.tobytes() for scan in drive],
    )


@pytest.mark.parametrize("name", CONTRADICTIONS)
def test_a_contradiction_is_refused_by_name(recording, name):
    path, messages, attachments = recording
    change, fault = CONTRADICTIONS[name]
    # Scan 3 has no point that could be changed.
    rng = np.random.default_rng(1)
    change(messages, rng)
    path.write_bytes(write_messages(messages, attachments))
    with pytest.raises(InputError, match=fault) as refusal:
        read_all(path)
    assert str(refusal.value).startswith(f"{path}: /")


def test_all_channels_of_a_topic_are_one_stream(recording):
    path, messages, attachments = recording
    whole = read_all(path)
    for number, one in enumerate(messages):
        messages[number] = one.copy(channel=number % 3)
    path.write_bytes(write_messages(messages, attachments))
    assert read_all(path) == whole


def test_repeated_messages_change_nothing(recording):
    path, messages, attachments = recording
    whole = open_drive(path)
    X_WS, mount = whole.X_WS, whole.X_BS
    again = [
        one.copy(channel=1)
        for one in messages
        if one.topic in ("/odometry", "/tf_static")
    ]
    path.write_bytes(write_messages(messages + again, attachments))
    drive = open_drive(path)
    np.testing.assert_array_equal(drive.X_WS, X_WS)
    np.testing.assert_array_equal(drive.X_BS, mount)
    assert len(drive.odometry) == 2 * len(whole.odometry)


def test_two_attachments_of_a_name_that_differ(recording):
    path, messages, attachments = recording
    one = attachments[0]
    assert one.name == "scenario.json"
    path.write_bytes(write_messages(messages, [*attachments, one]))
    assert open_drive(path).scenario["map"] == "town"
    other = type(one)(**{**vars(one), "data": b'{"map": "village"}'})
    path.write_bytes(write_messages(messages, [*attachments, other]))
    with pytest.raises(InputError, match=r"scenario\.json: two attachments"):
        _ = open_drive(path).scenario


def test_a_channel_that_the_summary_does_not_name(recording):
    path, messages, attachments = recording
    path.write_bytes(write_messages(messages, attachments))
    whole = open_drive(path).X_WS
    edit_summary(path, lambda one: one.channels.pop(max(one.channels)))
    # The summary is optional: the file itself names the channel.
    np.testing.assert_array_equal(open_drive(path).X_WS, whole)


_READ = """
import resource, sys
from evaluation.drives import (open_drive)
from evaluation.base.errors import InputError
try:
    drive = open_drive(sys.argv[1])
    drive.X_WS, drive.imu, [len(scan) for scan in drive]
    print("read")
except InputError as error:
    print(error)
if sys.platform == "linux":
    # getrusage counts the process from which this one was forked, too.
    (peak,) = (row for row in open("/proc/self/status") if "VmHWM" in row)
    print(int(peak.split()[1]) * 1024)
else:
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "topic",
    [
        pytest.param("/odometry", marks=pytest.mark.night),
        "/lidar/points",
        pytest.param("/tf_static", marks=pytest.mark.night),
    ],
)
def test_a_small_file_takes_little_memory(recording, topic):
    """The messages are nearly all padding, which zstd compresses to nothing."""
    path, messages, attachments = recording
    place = next(k for k, one in enumerate(messages) if one.topic == topic)
    padded = messages[place].copy()
    (getattr(padded.body, "transforms", None) or [padded.body])[
        0
    ].header.frame_id += " " * (30 << 20)
    more = [padded.copy(log_time=padded.log_time + k) for k in range(20)]
    path.write_bytes(write_messages(messages + more, attachments))
    assert path.stat().st_size < 1_000_000
    output = subprocess.run(
        [sys.executable, "-c", _READ, str(path)],
        check=True,
        capture_output=True,
        text=True,
    ).stdout.splitlines()
    assert output[0].startswith(str(path))
    assert int(output[1]) < 500_000_000
