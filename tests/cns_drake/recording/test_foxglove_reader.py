"""Recordings, as read by the libraries of Foxglove.

Foxglove itself cannot run here; it opens files with @mcap/core and its ROS 2
decoder.
"""

import json
import os
import shutil
import subprocess

from helpers.documents import ROOT
import numpy as np
import pytest
import yaml

from evaluation import drives

NODE = ROOT / "tests" / "node"
POINT_FIELDS = ("x", "y", "z", "intensity", "ring", "t", "label", "instance")


@pytest.fixture(scope="module")
def found(short_recording):
    """The output of Node for the recording."""
    if shutil.which("node") is None or not (NODE / "node_modules").is_dir():
        missing = "needs Node and `npm ci --prefix tests/node`"
        # If it was installed, its absence must not go unnoticed.
        if "CNS_DRAKE_TEST_NODE" in os.environ:
            pytest.fail(missing)
        pytest.skip(missing)
    (mcap,) = short_recording.glob("*.mcap")
    done = subprocess.run(
        ["node", NODE / "read_recording.mjs", mcap],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def to_ns(stamp):
    return stamp["sec"] * 10**9 + stamp["nsec"]


def test_profile_and_channels(found):
    assert found["profile"] == "ros2"
    assert found["library"].startswith("cns-drake ")
    types = {name: topic["type"] for name, topic in found["topics"].items()}
    assert types == {
        "/lidar/points": "sensor_msgs/msg/PointCloud2",
        "/imu/data": "sensor_msgs/msg/Imu",
        "/odometry": "nav_msgs/msg/Odometry",
        "/tf": "tf2_msgs/msg/TFMessage",
        "/tf_static": "tf2_msgs/msg/TFMessage",
    }
    for name, topic in found["topics"].items():
        assert topic["messageEncoding"] == "cdr"
        assert topic["schemaEncoding"] == "ros2msg"
        (qos,) = yaml.safe_load(topic["metadata"]["offered_qos_profiles"])
        # Values of rmw: reliable; transient local or volatile.
        assert qos["reliability"] == 1
        assert qos["durability"] == (1 if name == "/tf_static" else 2)
        assert topic["metadata"]["topic_type_hash"].startswith("RIHS01_")


def test_metadata_and_attachments(found, short_recording):
    record = yaml.safe_load(found["metadata"]["rosbag2"]["serialized_metadata"])
    beside = yaml.safe_load((short_recording / "metadata.yaml").read_text())
    assert record == beside["rosbag2_bagfile_information"]
    assert record["version"] == 8
    for name in ("scenario.json", "structures.json", "calibration.json"):
        assert found["attachments"][name]["mediaType"] == "application/json"
    scenario = found["attachments"]["scenario.json"]["content"]
    assert scenario["name"] == short_recording.name


def test_scans_are_those_that_we_read(found, short_recording):
    drive = drives.open_drive(short_recording)
    messages = found["topics"]["/lidar/points"]["messages"]
    assert len(messages) == len(drive) == 40
    for i, message in enumerate(messages):
        scan = drive.scan(i)
        content = message["content"]
        stamp_ns = int(drive.stamps_ns[i])
        assert message["sequence"] == i
        assert int(message["logTime"]) == stamp_ns
        assert to_ns(content["header"]["stamp"]) == stamp_ns
        assert content["header"]["frame_id"] == "lidar"
        assert content["points"] == len(scan)
        sums = {name: scan[name].sum(dtype=float) for name in POINT_FIELDS}
        assert content["sums"] == pytest.approx(sums, abs=1e-6)


def test_poses_are_those_that_we_read(found, short_recording):
    odometry = drives.open_drive(short_recording).odometry
    for topic, pick in (
        ("/odometry", lambda m: m["pose"]["pose"].values()),
        ("/tf", lambda m: m["transforms"][0]["transform"].values()),
    ):
        messages = found["topics"][topic]["messages"]
        assert len(messages) == len(odometry)
        for message, expected in zip(messages, odometry, strict=True):
            p, q = pick(message["content"])
            np.testing.assert_array_equal(
                list(p.values()), expected["position"]
            )
            np.testing.assert_array_equal(
                list(q.values()), expected["quat_xyzw"]
            )
