import struct
import tracemalloc

from helpers.contradictions import add_images, read_messages, write_messages
from helpers.drive_files import (
    PERIOD_NS,
    T0_NS,
    make_scan,
    write_recording,
    yaw_pose,
)
import lz4.frame
from mcap.writer import CompressionType, Writer
import numpy as np
import pytest
import zstandard

from evaluation import drives
from evaluation.base import InputError, poses
from evaluation.drives import RecentScans, check_same_world, open_drive

# A sensor that is turned as well as moved on its vehicle.
P_BS = (0.3, -0.2, 1.6)
QUAT_BS = (0.0, np.sin(0.1), 0.0, np.cos(0.1))


def make_drive(num_frames=7, points=200, seed=0):
    rng = np.random.default_rng([seed, num_frames])
    scans = [
        make_scan(rng.uniform(-50.0, 50.0, (points, 3)))
        for _ in range(num_frames)
    ]
    X_WBs = [
        yaw_pose(100.0 + 2.0 * i, -40.0 + i, 0.5, 0.3 * i)
        for i in range(num_frames)
    ]
    return scans, X_WBs


def record(folder, **options):
    scans, X_WBs = make_drive()
    return write_recording(folder, scans, X_WBs, **options), scans, X_WBs


def test_reads_what_was_written(tmp_path):
    record_path, scans, _ = record(
        tmp_path / "city_02", p_BS=P_BS, quat_xyzw_BS=QUAT_BS
    )
    for path in (record_path, record_path.parent):
        drive = open_drive(path)
        assert len(drive) == len(scans)
        np.testing.assert_array_equal(
            drive.stamps_ns, T0_NS + PERIOD_NS * np.arange(len(scans))
        )
        for i in (3, 0, 6, 5, 3):
            np.testing.assert_array_equal(drive.scan(i), scans[i])
    for path in (record_path, record_path.parent):
        assert open_drive(path).name == "city_02"
    assert drive.world_frame == "map"


def test_pose_is_odometry_and_mount_composed(tmp_path):
    path, _, X_WBs = record(tmp_path / "s", p_BS=P_BS, quat_xyzw_BS=QUAT_BS)
    c, s = np.cos(0.2), np.sin(0.2)
    X_BS = np.eye(4)
    X_BS[:3, :3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    X_BS[:3, 3] = P_BS
    X_WS = open_drive(path).X_WS
    for i, X_WB in enumerate(X_WBs):
        np.testing.assert_allclose(X_WS[i], X_WB @ X_BS, atol=1e-12)


def test_small_and_large_chunks_read_alike(tmp_path):
    scans, X_WBs = make_drive()
    drives = [
        open_drive(
            write_recording(
                tmp_path / f"c{size}", scans, X_WBs, chunk_size=size
            )
        )
        for size in (100, 10_000_000)
    ]
    for i in range(len(scans)):
        np.testing.assert_array_equal(drives[0].scan(i), drives[1].scan(i))
    np.testing.assert_array_equal(drives[0].X_WS, drives[1].X_WS)


@pytest.mark.parametrize("compression", list(CompressionType))
def test_all_compressions_are_read(tmp_path, compression):
    path, scans, X_WBs = record(tmp_path / "s", compression=compression)
    drive = open_drive(path)
    for read, written in zip(drive, scans, strict=True):
        np.testing.assert_array_equal(read, written)
    np.testing.assert_allclose(
        drive.odometry["position"], np.array(X_WBs)[:, :3, 3]
    )


def test_images_are_those_of_the_first_camera(tmp_path):
    """Images may be recorded late, in another order, or by another clock."""
    path, _, _ = record(tmp_path / "s")
    assert len(open_drive(path).image_stamps_ns) == 0
    for topic, start in (
        ("/depth/compressedDepth", 5),
        ("/front/image", 7),
        ("/left/image", 9),
    ):
        for late_ns, offset in ((10**15, start), (0, -2), (10**10, PERIOD_NS)):
            stamp_ns = T0_NS + offset
            image = f"{topic} {offset}".encode()
            add_images(path, topic, {stamp_ns: image}, late_ns)
    drive = open_drive(path)
    np.testing.assert_array_equal(
        drive.image_stamps_ns, [T0_NS - 2, T0_NS + 7, T0_NS + PERIOD_NS]
    )
    assert [drive.image(k) for k in range(3)] == [
        f"/front/image {offset}".encode() for offset in (-2, 7, PERIOD_NS)
    ]


def test_an_image_without_a_stamp_is_refused(tmp_path):
    path, _, _ = record(tmp_path / "s")
    add_images(path, "/front/image", {T0_NS: b"a", 0: b"b"}, T0_NS)
    with pytest.raises(InputError, match="/front/image: a message has no s"):
        _ = open_drive(path).image_stamps_ns


@pytest.mark.parametrize(
    ("compress", "name"),
    [(zstandard.compress, "zstd"), (lz4.frame.compress, "lz4")],
)
@pytest.mark.parametrize("topic", ["/lidar/points", "/odometry", "/tf_static"])
def test_a_recording_without_compressed_messages_is_read(
    tmp_path, monkeypatch, compress, name, topic
):
    add_message = Writer.add_message
    numbers = {"/lidar/points": 1, "/odometry": 2, "/tf_static": 3}

    def add(writer, channel_id, log_time, data, *others):
        if channel_id == numbers[topic]:
            data = compress(data)
        add_message(writer, channel_id, log_time, data, *others)

    with monkeypatch.context() as patch:
        patch.setattr(Writer, "add_message", add)
        path, _, _ = record(tmp_path / "s")
    said = f"{topic}: each message is compressed by {name}.*; convert the rec"
    with pytest.raises(InputError, match=said):
        _ = open_drive(path).X_WS
    path, _, _ = record(tmp_path / "converted")
    assert len(open_drive(path).X_WS)


@pytest.mark.parametrize("ending", ["zstd", "zst"])
def test_a_compressed_file_is_read_when_uncompressed(tmp_path, ending):
    path, _, _ = record(tmp_path / "s")
    packed = path.with_name(f"{path.name}.{ending}")
    packed.write_bytes(zstandard.compress(path.read_bytes()))
    path.unlink()
    for one in (packed, packed.parent):
        said = f"{packed.name}: a packed file; unpack it first"
        with pytest.raises(InputError, match=said):
            open_drive(one)
    path.write_bytes(zstandard.decompress(packed.read_bytes()))
    packed.unlink()
    for one in (path, path.parent):
        assert len(open_drive(one).X_WS)


def test_hidden_files_are_no_recordings(tmp_path):
    path, scans, _ = record(tmp_path / "s")
    # macOS leaves such a file beside each on disks of other systems.
    (path.parent / f"._{path.name}").write_bytes(b"\0\5\x16\7" * 9)
    assert len(open_drive(path.parent)) == len(scans)
    path.unlink()
    with pytest.raises(InputError, match="not a recorded drive"):
        open_drive(path.parent)


def test_scenario_and_structures(tmp_path):
    path, _, _ = record(
        tmp_path / "s",
        attachments={
            "scenario.json": {"map": "m", "stage": "02", "route": {"a": 1}},
            "structures.json": [
                {"instance": 7, "name": "tower_017", "class": "building"}
            ],
        },
    )
    drive = open_drive(path)
    assert drive.scenario["stage"] == "02"
    assert drive.instances[7]["name"] == "tower_017"
    bare = open_drive(record(tmp_path / "bare")[0])
    assert bare.scenario is None
    assert bare.instances is None


@pytest.mark.parametrize(
    ("attachments", "attribute"),
    [
        ({"scenario.json": [1]}, "scenario"),
        ({"structures.json": {"a": 1}}, "instances"),
        ({"structures.json": [{"name": "a"}]}, "instances"),
    ],
)
def test_attachments_of_another_kind(tmp_path, attachments, attribute):
    path, _, _ = record(tmp_path / "s", attachments=attachments)
    with pytest.raises(
        InputError, match=f"{path}: attachment .*json: (not a|no) "
    ):
        getattr(open_drive(path), attribute)


def test_another_lidar_topic_if_it_is_the_only_one(tmp_path):
    path, scans, _ = record(tmp_path / "s", lidar_topic="/roof/points")
    np.testing.assert_array_equal(open_drive(path).scan(2), scans[2])


def test_odometry_and_imu_of_a_simulated_drive(short_recording):
    drive = drives.open_drive(short_recording)
    odometry, imu = drive.odometry, drive.imu
    assert len(odometry) == len(imu) == len(drive) == 40
    for table in (odometry, imu):
        np.testing.assert_array_equal(table["stamp_ns"], drive.stamps_ns)
    # The LiDAR sits upright above the vehicle, the IMU in line with both.
    np.testing.assert_allclose(
        odometry["position"] + [0.0, 0.0, 1.6],
        drive.X_WS[:, :3, 3],
        atol=1e-12,
    )
    np.testing.assert_allclose(odometry["quat_xyzw"], imu["quat_xyzw"])
    # The drive starts at rest on level ground: the change of speed is the
    # specific force.
    speed = odometry["velocity"][:, 0]
    assert speed[0] == 0.0
    assert speed[-1] > 0.5
    force = imu["specific_force"]
    np.testing.assert_allclose(force[:, 2], 9.81, atol=1e-9)
    gained = np.sum(0.5 * (force[1:, 0] + force[:-1, 0])) * 0.05
    assert gained == pytest.approx(speed[-1], rel=1e-2)
    np.testing.assert_array_equal(drive.X_BI[:3, 3], [-1.0, 0.0, 1.6])


def test_without_an_imu(tmp_path):
    drive = open_drive(record(tmp_path / "s")[0])
    assert drive.imu is None
    assert drive.X_BI is None


def test_one_lidar_of_several_by_name(tmp_path):
    path, scans, _ = record(tmp_path / "s", lidar_topic="/roof/points")
    drive = drives.open_drive(path, lidar="roof")
    np.testing.assert_array_equal(drive.scan(2), scans[2])
    with pytest.raises(
        InputError, match=r"no topic /rear/points \(point clouds: /roof/points"
    ):
        drives.open_drive(path, lidar="rear")


LIDARS = ("/velodyne_points", "/livox/lidar", "/roof/points", "/roof")


@pytest.mark.parametrize(
    ("name", "topic"),
    [
        *((topic, topic) for topic in LIDARS),
        ("velodyne_points", "/velodyne_points"),
        ("livox/lidar", "/livox/lidar"),
        ("roof", "/roof/points"),
    ],
)
def test_a_lidar_on_any_topic(tmp_path, name, topic):
    path, scans, _ = record(tmp_path / "s", lidar_topic=LIDARS[0])
    messages, attachments = read_messages(path.read_bytes())
    clouds = [one for one in messages if one.topic == LIDARS[0]]
    for number, other in enumerate(LIDARS[1:], start=1):
        # Number k has the scans from k on.
        messages += [one.copy(topic=other) for one in clouds[number:]]
    path.write_bytes(write_messages(messages, attachments))
    drive = drives.open_drive(path, lidar=name)
    first = scans[LIDARS.index(topic)]
    np.testing.assert_array_equal(drive.scan(0)["x"], first["x"])
    # All names that it lists can be given.
    assert len(set(drive.lidar_names)) == len(LIDARS)
    for one in drive.lidar_names:
        assert drives.open_drive(path, lidar=one).lidar_name == one
    with pytest.raises(InputError, match=r"/roof; choose one as the LiDAR"):
        drives.open_drive(path)


def test_memory_does_not_grow_with_the_drive(tmp_path):
    scans, X_WBs = make_drive(num_frames=150, points=4000)
    path = write_recording(tmp_path / "s", scans, X_WBs, chunk_size=100_000)
    del scans
    drive = open_drive(path)
    _ = drive.X_WS
    peaks = []
    tracemalloc.start()
    try:
        for _ in range(2):
            for i, scan in enumerate(drive):
                assert len(scan) == 4000
                if i in (20, 149):
                    peaks.append(tracemalloc.get_traced_memory()[1])
    finally:
        tracemalloc.stop()
    # All scans take 17 MB.
    assert peaks[-1] < 1.2 * peaks[0]
    assert peaks[-1] < 2_000_000


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        ({"topics": ("/odometry", "/tf_static")}, "/lidar/points"),
        ({"topics": ("/lidar/points", "/tf_static")}, "/odometry"),
    ],
)
def test_a_missing_topic_is_named(tmp_path, options, fault):
    path, _, _ = record(tmp_path / "s", **options)
    with pytest.raises(InputError, match=f"{path}: no topic {fault}"):
        open_drive(path)


def test_two_scans_of_one_stamp(tmp_path):
    stamps = [T0_NS + i * PERIOD_NS for i in (0, 1, 2, 2, 4, 5, 6)]
    path, _, _ = record(tmp_path / "s", stamps_ns=stamps)
    with pytest.raises(InputError, match="two different messages with the st"):
        _ = open_drive(path).stamps_ns


def test_mount_that_leads_nowhere(tmp_path):
    path, _, _ = record(tmp_path / "s", mast="other_link")
    with pytest.raises(
        InputError, match="no transform from base_link to lidar"
    ):
        _ = open_drive(path).X_WS


def test_truncated_at_any_place(tmp_path):
    path, _, _ = record(tmp_path / "s")
    whole = path.read_bytes()
    for size in np.linspace(0, len(whole) - 1, 40).astype(int):
        path.write_bytes(whole[:size])
        with pytest.raises(InputError, match=f"^{path}: .*MCAP"):
            open_drive(path)


def everything_of(path):
    drive = open_drive(path)
    return (
        [scan.tobytes() for scan in drive],
        drive.stamps_ns.tobytes(),
        drive.X_WS.tobytes(),
        drive.odometry.tobytes(),
        drive.scenario,
        drive.instances,
    )


def test_flipped_bits_are_noticed(tmp_path):
    """Bits flip in chunks, indexes, the summary and attachments."""
    scans, X_WBs = make_drive(num_frames=4, points=20)
    path = write_recording(
        tmp_path / "s",
        scans,
        X_WBs,
        chunk_size=2000,
        attachments={
            "scenario.json": {"map": "town", "stage": "02"},
            "structures.json": [{"instance": 1, "name": "a"}],
        },
    )
    whole = path.read_bytes()
    written = everything_of(path)
    rng = np.random.default_rng(11)
    faults = []
    for position in rng.choice(len(whole), 400, replace=False):
        damaged = bytearray(whole)
        damaged[position] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        try:
            assert everything_of(path) == written
        except InputError as error:
            faults.append(str(error))
    assert len(faults) > 300
    for fault in faults:
        assert fault.startswith(str(path))
        assert "\n" not in fault


def tamper(path, change):
    """Replaces the record of the first chunk by the result of `change`."""
    data = path.read_bytes()
    stream = open_drive(path)._file
    start = stream._contents.blocks[0]
    (length,) = struct.unpack_from("<Q", data, start + 1)
    body = bytearray(data[start + 9 : start + 9 + length])
    change(body)
    assert len(body) == length
    path.write_bytes(data[: start + 9] + body + data[start + 9 + length :])


def test_folders_without_a_recording(tmp_path):
    with pytest.raises(InputError, match="no such file or folder"):
        open_drive(tmp_path / "missing")
    with pytest.raises(InputError, match="not a recorded drive"):
        open_drive(tmp_path)
    text = tmp_path / "a.mcap"
    text.write_text("no mcap")
    with pytest.raises(InputError, match="not an MCAP file"):
        open_drive(text)
    unfinished = tmp_path / "unfinished"
    unfinished.mkdir()
    (unfinished / ".unfinished_0.mcap.0123.part").write_bytes(b"")
    with pytest.raises(InputError, match="was not finished"):
        open_drive(unfinished)
    path, _, _ = record(tmp_path / "two")
    (path.parent / "other.mcap").write_bytes(path.read_bytes())
    with pytest.raises(InputError, match=r"2 \.mcap files instead of one"):
        open_drive(path.parent)


def test_drives_of_different_worlds_are_refused(tmp_path):
    def drive(name, **options):
        return open_drive(record(tmp_path / name, **options)[0])

    plain = drive("plain")
    other_frame = drive("odd", world_frame="utm")
    with pytest.raises(InputError, match=r"'utm'.*'map'"):
        check_same_world(plain, other_frame)
    assert not (*plain.notes, *other_frame.notes)
    cities = [
        drive(name, attachments={"scenario.json": {"map": city}})
        for name, city in (
            ("a", "metropolis"),
            ("b", "/data/worlds/metropolis"),
            ("c", "riverside"),
        )
    ]
    check_same_world(cities[0], cities[1])
    check_same_world(plain, cities[2])
    with pytest.raises(InputError, match="through riverside"):
        check_same_world(cities[0], cities[2])


@pytest.mark.parametrize("frame", ["odom", "camera_init", "map_local", "Map"])
def test_a_local_frame_is_of_one_recording(tmp_path, frame):
    """By REP 105, `odom` begins anew; equal words name different frames."""

    def drive(name):
        return open_drive(tmp_path / name)

    for name in "abc":
        record(tmp_path / name, world_frame=frame)
    first, second = drive("a"), drive("b")
    assert first.is_local
    assert first.world == drive("a").world != second.world
    for one in (second, RecentScans(second, 1)):
        with pytest.raises(InputError, match=rf"{frame}/.* in '{frame}/"):
            check_same_world(first, one)
    check_same_world(first, drive("a"))
    for name, city in (("a", "town"), ("b", "maps/town"), ("c", "village")):
        (tmp_path / name / "scenario.yaml").write_text(f"map: {city}\n")
    # A user says that both are in one world.
    check_same_world(drive("a"), drive("b"))
    assert drive("a").world == frame
    with pytest.raises(InputError, match="through village"):
        check_same_world(drive("a"), drive("c"))


@pytest.mark.parametrize("frame", ["map", "utm", "earth", "world", "enu"])
def test_a_shared_frame_is_of_all_recordings(tmp_path, frame):
    one, other = (
        open_drive(record(tmp_path / name, world_frame=frame)[0])
        for name in "ab"
    )
    check_same_world(one, other)


def test_index_out_of_range(tmp_path):
    drive = open_drive(record(tmp_path / "s")[0])
    for index in (-1, len(drive)):
        with pytest.raises(IndexError):
            drive.scan(index)


def test_pose_arithmetic():
    rng = np.random.default_rng(3)
    R = poses.rotation_from_quaternion(rng.normal(size=(20, 4)))
    np.testing.assert_allclose(
        R @ np.swapaxes(R, 1, 2),
        np.broadcast_to(np.eye(3), (20, 3, 3)),
        atol=1e-12,
    )
    np.testing.assert_allclose(np.linalg.det(R), 1.0)
    half = np.sqrt(0.5)
    quarter = poses.rotation_from_quaternion(np.array([0, 0, half, half]))
    np.testing.assert_allclose(
        quarter @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-12
    )
    X = poses.make_pose(R, rng.normal(size=(20, 3)))
    np.testing.assert_allclose(
        poses.inverse(X) @ X,
        np.broadcast_to(np.eye(4), (20, 4, 4)),
        atol=1e-12,
    )
    p = rng.normal(size=(5, 3))
    np.testing.assert_allclose(
        poses.transform(X[0], p), (R[0] @ p.T).T + X[0, :3, 3]
    )
    with pytest.raises(ValueError, match="quaternion"):
        poses.rotation_from_quaternion(np.zeros(4))


def test_an_index_that_points_behind_the_file(tmp_path):
    path, _, _ = record(tmp_path / "s")
    drive = open_drive(path)
    drive._file._contents.blocks[0] = 10**12
    with pytest.raises(InputError, match=f"^{path}: damaged MCAP file"):
        drive.scan(0)
