"""Bags by the conventions of public programs are read as they are."""

import pickle

from helpers.bags import (
    LIVOX,
    cloud,
    header,
    join_bags,
    pose,
    transform,
    write_bag,
)
from helpers.drive_files import T0_NS, write_recording, yaw_pose
from mcap.writer import Writer
import numpy as np
import pytest

from evaluation.base import InputError, poses, xyz
from evaluation.drives import open_drive
from evaluation.study import find_recordings

POINTS = "sensor_msgs/msg/PointCloud2"
ODOMETRY = "nav_msgs/msg/Odometry"
STATIC = "tf2_msgs/msg/TFMessage"
NUM_SCANS = 12
ID = np.eye(4)
X_BS = yaw_pose(0.4, -0.1, 1.7, 0.3)
NUM_POINTS = 60
p_WP = np.random.default_rng(4).uniform(-30.0, 30.0, (NUM_POINTS, 3))


def X_WB(stamp_ns):
    """Returns where the robot is; it turns and drives evenly."""
    t = (stamp_ns - T0_NS) * 1e-9
    return yaw_pose(3.0 * t, 1.0 - t, 0.2 * t, 0.4 * t - 0.2)


STAMPS = [T0_NS + 100_000_000 * k for k in range(NUM_SCANS)]
# Poses come when they come, from before the first scan to behind the last.
POSE_STAMPS = [T0_NS - 17_000_000 + 33_000_000 * k for k in range(38)]


def points_of(X_WS, names="x y z intensity"):
    """Returns the points in a LiDAR's frame, with further fields."""
    kinds = {"ring": "<u2", "t": "<u4", "time_stamp": "<u4", "channel": "<u2"}
    kinds |= {"timestamp": "<f8", "tag": "u1"}
    dtype = [(name, kinds.get(name, "<f4")) for name in names.split()]
    found = np.zeros(len(p_WP), dtype)
    for axis, values in zip(
        "xyz", poses.transform(poses.inverse(X_WS), p_WP).T, strict=True
    ):
        found[axis] = values
    return found


def clouds(topic, frame, names="x y z intensity", X_BS=X_BS, in_world=False):
    for stamp in STAMPS:
        X_WS = ID if in_world else X_WB(stamp) @ X_BS
        points = points_of(X_WS, names)
        yield topic, POINTS, stamp, cloud(points, frame, stamp)


def livox(topic, frame, X_BS=X_BS):
    for stamp in STAMPS:
        points = [
            {"x": x, "y": y, "z": z, "offset_time": k, "line": k % 4}
            for k, (x, y, z) in enumerate(xyz(points_of(X_WB(stamp) @ X_BS)))
        ]
        fields = {"header": header(stamp, frame), "points": points}
        yield topic, LIVOX, stamp, fields


def odometry(topic, frame, child, X_BC=ID, away=0.0):
    for stamp in POSE_STAMPS:
        X = X_WB(stamp) @ X_BC
        X[0, 3] += away
        fields = {
            "header": header(stamp, frame),
            "child_frame_id": child,
            "pose": {"pose": pose(X)},
        }
        yield topic, ODOMETRY, stamp, fields


def stamped(topic, frame, kind="PoseStamped", X_BC=ID):
    for stamp in POSE_STAMPS:
        X = pose(X_WB(stamp) @ X_BC)
        fields = {"header": header(stamp, frame)}
        fields["pose"] = {"pose": X} if "Covariance" in kind else X
        yield topic, f"geometry_msgs/msg/{kind}", stamp, fields


def paths(topic, frame, X_BC, window=0):
    """Each message has all poses up to then, or only the latest ones."""
    number = len(POSE_STAMPS)
    for n in range(window, number + 1) if window else (20, number):
        rows = list(stamped(topic, frame, X_BC=X_BC))[:n][-window:]
        fields = {"header": header(T0_NS, frame)}
        fields["poses"] = [of_pose for *_, of_pose in rows]
        if n == window:  # A later message corrects a pose.
            fields["poses"][5]["pose"]["position"][0] += 5.0
        yield topic, "nav_msgs/msg/Path", T0_NS + n, fields


def static(*edges):
    rows = [transform(*edge, T0_NS) for edge in edges]
    return [("/tf_static", STATIC, T0_NS, {"transforms": rows})]


def vicon(topic, frame, child):
    for stamp in POSE_STAMPS:
        fields = transform(frame, child, X_WB(stamp), stamp)
        yield topic, "geometry_msgs/msg/TransformStamped", stamp, fields


BASE = ("base_link", "velodyne", X_BS)
TAKEN = "are taken as those of this LiDAR"
BAGS = {
    "FAST-LIO, Livox, ROS 1": (
        [*livox("/livox/lidar", "livox_frame", ID),
         *odometry("/Odometry", "camera_init", "body"),
         *paths("/path", "camera_init", ID)],
        {"storage": "lz4", "ending": ".bag"}, {}, TAKEN,
    ),
    "FAST-LIO, registered": (
        [*clouds("/cloud_registered", "camera_init", in_world=True),
         *clouds("/cloud_registered_body", "body", X_BS=ID),
         *odometry("/Odometry", "camera_init", "body")],
        {"storage": "sqlite3"}, {"lidar": "/cloud_registered"},
        "are moved into the frame 'body'",
    ),
    "FAST-LIO, in the body": (
        [*clouds("/cloud_registered", "camera_init", in_world=True),
         *clouds("/cloud_registered_body", "body", X_BS=ID),
         *odometry("/Odometry", "camera_init", "body")],
        {}, {"lidar": "cloud_registered_body"}, "interpolated",
    ),
    "KISS-ICP": (
        [*clouds("/velodyne_points", "velodyne", "x y z intensity ring time"),
         *clouds("/kiss/local_map", "odom_lidar", in_world=True),
         *odometry("/kiss/odometry", "odom_lidar", "velodyne", X_BS)],
        {}, {"lidar": "/velodyne_points"}, "poses are interpolated",
    ),
    "robot_localization": (
        [*static(BASE), *clouds("/velodyne_points", "velodyne"),
         *odometry("/odometry/filtered", "odom", "base_link", away=50.0),
         *odometry("/odometry/filtered_map", "map", "base_link")],
        {"storage": "sqlite3"}, {"odometry": "/odometry/filtered_map"}, "inter",
    ),
    "Autoware, split": (
        [*static(("base_link", "sensor_kit_base_link", X_BS),
                 ("sensor_kit_base_link", "velodyne_top", ID)),
         *clouds("/sensing/lidar/top/pointcloud_raw_ex", "velodyne_top",
                 "x y z intensity time_stamp channel"),
         *stamped("/localization/pose_estimator/pose", "map"),
         *odometry("/localization/kinematic_state", "map", "base_link")],
        {"split": True}, {}, "interpolated at 1",
    ),
    "ouster-ros": (
        [*static(("os_sensor", "os_lidar", X_BS),
                 ("os_sensor", "os_imu", X_BS)),
         *clouds("/ouster/points", "os_lidar", "x y z intensity t ring"),
         *odometry("/odom", "map", "os_imu", X_BS)],
        {"storage": "mcap-message"}, {}, "interpolated",
    ),
    "velodyne, ROS 1 with tf": (
        [*static(("/base_link", "/velodyne", X_BS)),
         *clouds("/velodyne_points", "/velodyne", "x y z intensity ring time"),
         *odometry("/odom", "/map", "/base_link")],
        {"ending": ".bag"}, {}, "interpolated",
    ),
    "LIO-SAM": (
        [*clouds("/points_raw", "base_link", X_BS=ID),
         *odometry("/lio_sam/mapping/odometry", "odom", "odom_mapping", away=9),
         *paths("/lio_sam/mapping/path", "odom", ID)],
        {"ending": ".bag", "storage": "bz2"},
        {"odometry": "lio_sam/mapping/path"}, TAKEN,
    ),
    "a window of poses": (
        [*clouds("/points_raw", "base_link", X_BS=ID),
         *paths("/path", "odom", ID, window=12)],
        {}, {}, TAKEN,
    ),
    "Vicon": (
        [*static(("robot", "velodyne", X_BS)),
         *clouds("/velodyne_points", "velodyne"),
         *vicon("/vicon/robot/robot", "world", "robot")],
        {"storage": "sqlite3-file"}, {}, "interpolated",
    ),
    "NDT": (
        [*clouds("/lexus3/os_center/points", "base_link"),
         *stamped("/ndt_pose", "map", "PoseWithCovarianceStamped", X_BS)],
        {"storage": "sqlite3-message"}, {}, "names no frame of the vehicle",
    ),
    "Hesai, ros2 bag record -a": (
        [*static(("base_link", "hesai_lidar", X_BS)),
         *clouds("/lidar_points", "hesai_lidar", "x y z ring timestamp"),
         *odometry("/odometry", "map", "base_link")],
        {"empty": [("/imu/data", "sensor_msgs/msg/Imu"), ("/tf", STATIC),
                   ("/rear/points", POINTS), ("/odom", ODOMETRY)]},
        {}, "interpolated",
    ),
    "Livox, ROS 2, shuffled log times": (
        [*static(("base_link", "livox_frame", X_BS)),
         *livox("/livox/lidar", "livox_frame"),
         *odometry("/odom", "map", "base_link")],
        {"shuffled": True}, {}, "interpolated",
    ),
}  # fmt: skip


def write(folder, entries, split=False, shuffled=False, ending="", **options):
    rng = np.random.default_rng(2)
    if shuffled:
        times = [stamp for _, _, stamp, _ in entries]
        options["log_times"] = rng.permutation(times)
    if not split:
        path = write_bag(folder / f"ride_0{ending}", entries, **options)
    else:
        write_bag(folder / "other", entries[1::2], **options)
        path = write_bag(folder / "first", entries[::2], **options)
        join_bags(path, folder / "other")
    return path


@pytest.mark.parametrize("name", BAGS)
def test_a_bag_is_read_as_it_is(tmp_path, name):
    entries, options, reading, note = BAGS[name]
    drive = open_drive(write(tmp_path, entries, **options), **reading)
    assert drive.stamps_ns.tolist() == STAMPS
    for k, scan in enumerate(pickle.loads(pickle.dumps(drive))):
        seen = poses.transform(drive.X_WS[k], xyz(scan))
        np.testing.assert_allclose(seen, p_WP, atol=1e-4)
    assert note in "; ".join(drive.notes)


def test_poses_from_a_file(tmp_path):
    """KISS-ICP writes a trajectory of the LiDAR, as TUM or as KITTI."""
    path = write(tmp_path, [*clouds("/points", "os_lidar")])
    with pytest.raises(InputError, match=r"msg/Odometry .*--poses FILE"):
        open_drive(path)
    rows = []
    for stamp in POSE_STAMPS:
        found = pose(X_WB(stamp) @ X_BS)
        place = [*found["position"], *found["orientation"]]
        rows.append(f"{stamp / 1e9:.9f} {' '.join(map(str, place))}\n")
    tum = tmp_path / "poses.tum"
    tum.write_text("# timestamp x y z qx qy qz qw\n" + "".join(rows[1:-4]))
    kitti = tmp_path / "poses.txt"
    X_WS = np.array([X_WB(stamp) @ X_BS for stamp in STAMPS])
    np.savetxt(kitti, X_WS[:, :3].reshape(-1, 12))
    for file, kept in ((tum, slice(1, -1)), (kitti, slice(0, 12))):
        drive = pickle.loads(pickle.dumps(open_drive(path, poses=file)))
        assert drive.stamps_ns.tolist() == STAMPS[kept]
        np.testing.assert_allclose(drive.X_WS, X_WS[kept], atol=1e-5)
        assert file in drive.files
        seen = poses.transform(drive.X_WS[3], xyz(drive.scan(3)))
        np.testing.assert_allclose(seen, p_WP, atol=1e-4)


def test_a_scenario_beside_a_bag_states_map_stage_and_lidar(tmp_path):
    """A robot's bag does not say where it was recorded, and by what."""
    entries, *_ = BAGS["LIO-SAM"]
    path = write(tmp_path, entries)
    options = {"odometry": "lio_sam/mapping/path"}
    drive = open_drive(path, **options)
    assert drive.scenario is None
    assert drive.lidar_field is None
    beside = path / "scenario.yaml"
    beside.write_text("name: walk_1\nmap: campus\nstage: '2021'\n")
    drive = open_drive(path, **options)
    assert drive.name == "walk_1"
    assert drive.scenario["map"] == "campus"
    assert beside in drive.files
    # A drive that was not simulated has no default LiDAR.
    assert drive.lidar_field is None
    beside.write_text("lidars: {lidar: {preset: vlp-16}}\n")
    assert open_drive(path, **options).lidar_field.rings == 16
    for text, fault in (
        ("[]", "not a mapping"),
        ("lidars: vlp-16", "lidars: not a mapping"),
        ("lidars: {a: {preset: VLP16}}", "lidars.a: preset: .*mean vlp-16"),
    ):
        beside.write_text(text)
        with pytest.raises(InputError, match=rf"scenario\.yaml: {fault}"):
            open_drive(path, **options).lidar_field  # noqa: B018  # Reads it.


def test_points_in_a_world_are_moved_to_the_poses_of_a_file(tmp_path):
    """FAST-LIO's registered clouds, with its trajectory beside the bag."""
    entries = clouds("/cloud_registered", "camera_init", in_world=True)
    path = write(tmp_path, [*entries])
    kitti = tmp_path / "poses.txt"
    X_WS = np.array([X_WB(stamp) for stamp in STAMPS])
    np.savetxt(kitti, X_WS[:, :3].reshape(-1, 12))
    drive = open_drive(path, poses=kitti)
    assert "'camera_init' is that of a world" in "; ".join(drive.notes)
    seen = poses.transform(drive.X_WS[3], xyz(drive.scan(3)))
    np.testing.assert_allclose(seen, p_WP, atol=1e-4)


@pytest.mark.parametrize(
    ("header", "columns", "sign", "is_ns"),
    [
        ("#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [],"
         " q_RS_x [], q_RS_y [], q_RS_z []", [0, 1, 2, 3, 7, 4, 5, 6], ", ",
         True),
        ("num,t,x,y,z,qx,qy,qz,qw", [8, 0, 1, 2, 3, 4, 5, 6, 7], ",", False),
        ("time;qw;qx;qy;qz;x;y;z", [0, 7, 4, 5, 6, 1, 2, 3], ";", False),
        ("", range(8), "  ", False),
        ("", range(8), ",", False),
    ],
)  # fmt: skip
def test_tables_of_poses_in_other_forms(tmp_path, header, columns, sign, is_ns):
    """EuRoC's and MCD's, with a row of NaN as SLAM programs write."""
    path = write(tmp_path, [*clouds("/points", "os_lidar")])
    lines = [header] if header else []
    for k, stamp in enumerate(STAMPS):
        found = pose(X_WB(stamp) @ X_BS)
        words = [str(stamp) if is_ns else f"{stamp / 1e9:.9f}"]
        words += map(str, [*found["position"], *found["orientation"], k])
        lines.append(sign.join(words[column] for column in columns))
    before = str(STAMPS[0] - 10**8) if is_ns else f"{STAMPS[0] / 1e9 - 0.1:.9f}"
    lost = ["nan"] * 9
    lost[0] = before
    lines.insert(len(lines) - 12, sign.join(lost[c] for c in columns))
    file = tmp_path / "poses.csv"
    file.write_text("\n".join([*lines, ""]))
    drive = open_drive(path, poses=file)
    X_WS = np.array([X_WB(stamp) @ X_BS for stamp in STAMPS])
    np.testing.assert_allclose(drive.X_WS, X_WS, atol=1e-5)
    assert any("1 poses without numbers" in note for note in drive.notes)


@pytest.mark.parametrize("is_number", [False, True])
def test_matrices_behind_a_time_or_a_number(tmp_path, is_number):
    """MulRan's form, and KITTI-360's, which lacks some scans."""
    path = write(tmp_path, [*clouds("/points", "os_lidar")])
    X_WS = np.array([X_WB(stamp) @ X_BS for stamp in STAMPS])
    rows = [
        ",".join(map(str, [k if is_number else stamp, *X[:3].ravel()]))
        for k, (stamp, X) in enumerate(zip(STAMPS, X_WS, strict=True))
        if k not in (3, 4)
    ]
    file = tmp_path / "poses.csv"
    file.write_text("\n".join(rows))
    found = open_drive(path, poses=file).X_WS
    np.testing.assert_allclose(found, X_WS, atol=0.05)
    others = np.delete(np.arange(len(X_WS)), [3, 4])
    np.testing.assert_allclose(found[others], X_WS[others], atol=1e-9)


@pytest.mark.parametrize("field", ["position", "orientation"])
def test_poses_without_numbers_in_a_bag_are_left_out(tmp_path, field):
    """A SLAM program that has not started sends zeros or NaN."""
    entries = [
        *static(BASE),
        *clouds("/lidar/points", "velodyne"),
        *odometry("/odometry", "map", "base_link"),
    ]
    path = write(tmp_path, entries)
    wanted = open_drive(path).X_WS
    sent = [one for one in entries if one[0] == "/odometry"]
    lost = np.nan if field == "position" else 0.0
    for _, _, _, message in sent[3:5]:
        pose_of = message["pose"]["pose"]
        pose_of[field] = [lost] * len(pose_of[field])
    drive = open_drive(write(tmp_path / "b", entries))
    np.testing.assert_allclose(drive.X_WS, wanted, atol=0.05)
    assert any("2 poses without numbers" in note for note in drive.notes)


def test_a_table_of_poses_of_no_form_names_its_cure(tmp_path):
    path = write(tmp_path, [*clouds("/points", "os_lidar")])
    rows = []
    for k, stamp in enumerate(STAMPS):
        found = pose(X_WB(stamp) @ X_BS)
        place = [*found["position"], *found["orientation"]]
        rows.append(f"{k} {stamp / 1e9:.9f} {' '.join(map(str, place))}\n")
    file = tmp_path / "poses.txt"
    file.write_text("".join(rows))
    said = "rows of 9 numbers; TUM has 8 .*; name the columns in a first line"
    with pytest.raises(InputError, match=said):
        _ = open_drive(path, poses=file).X_WS
    file.write_text("number time x y z qx qy qz qw\n" + "".join(rows))
    assert len(open_drive(path, poses=file).X_WS) == len(STAMPS)


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        ({"lidar": "rear"}, r"no topic /rear/points \(point clouds: /points"),
        ({"odometry": "/p"}, r"no topic /p \(poses: /odometry, with --odom"),
        ({"odometry": "/points"}, "/points: .*instead of nav_msgs/msg/Odom"),
        ({"lidar": "/late"}, "/late: no message"),
        ({}, r"/odometry: no pose for .* are 1\.\d+ s apart, more than 1 s"),
    ],
)
def test_what_is_missing_is_named(tmp_path, options, fault):
    poses_there = [*odometry("/odometry", "map", "os", X_BS)]
    rows = [*clouds("/points", "os"), *poses_there[:2], *poses_there[-3:]]
    path = write_bag(tmp_path / "a", rows, empty=[("/late", POINTS)])
    with pytest.raises(InputError, match=fault):
        _ = open_drive(path, **options).X_WS


@pytest.mark.parametrize("gap", [None, 1.0, 1.25])
def test_poses_of_a_receiver_at_1_hz_need_an_option(tmp_path, gap):
    """Its clock jitters about a second, which is the limit."""
    times = [T0_NS, T0_NS + 1_200_000_000]
    rows = list(odometry("/odom", "map", "os", X_BS))
    few = [
        (*row[:2], t, {**row[3], "header": header(t, "map")})
        for row, t in zip((rows[0], rows[-1]), times, strict=True)
    ]
    path = write_bag(tmp_path / "a", [*clouds("/points", "os"), *few])
    if gap == 1.25:
        assert len(open_drive(path, pose_gap=gap)) == NUM_SCANS
        return
    said = r"1\.2 s apart, more than 1 s \(--pose-gap SECONDS allows more\)"
    with pytest.raises(InputError, match=said):
        _ = open_drive(path, pose_gap=gap).X_WS


def test_recordings_are_opened_as_they_were_found(tmp_path):
    """With the options of the command, in the processes of jobs, too."""
    rows = [*odometry("/odom", "map", "os", X_BS)]
    far = rows[:1] + rows[-1:]
    other = [("/gnss", *one[1:]) for one in far]
    write_bag(tmp_path / "town_1", [*clouds("/points", "os"), *rows, *other])
    with pytest.raises(InputError, match="--odometry TOPIC"):
        find_recordings(tmp_path)
    with pytest.raises(InputError, match="--pose-gap SECONDS allows more"):
        find_recordings(tmp_path, odometry="/gnss")
    of_gaps = [
        find_recordings(tmp_path, odometry="/gnss", pose_gap=gap)[0].source
        for gap in (2.0, 3.0)
    ]
    assert len(of_gaps[0]()) == NUM_SCANS
    assert of_gaps[0].identity() != of_gaps[1].identity()


@pytest.mark.parametrize(("moved", "is_read"), [(0.04, True), (0.06, False)])
def test_a_gap_in_which_the_robot_stands_is_none(tmp_path, moved, is_read):
    """As of amcl, which sends no pose while the robot stands."""
    rows = [
        (name, kind, stamp, moved_to(fields, stamp, k * moved))
        for k, stamp in enumerate((T0_NS, T0_NS + 2 * 10**9))
        for name, kind, _, fields in [*odometry("/odom", "map", "os")][:1]
    ]
    drive = open_drive(write_bag(tmp_path / "a", [*clouds("/p", "os"), *rows]))
    if not is_read:
        with pytest.raises(InputError, match="2 s apart, more than 1 s"):
            _ = drive.X_WS
        return
    assert np.ptp(drive.X_WS[:, 0, 3]) < moved
    assert "the vehicle is taken to stand" in drive.notes[0]


@pytest.mark.parametrize("is_moving", [False, True])
def test_a_mount_on_tf_is_read_if_it_never_moves(tmp_path, is_moving):
    """The package tf, before tf2, repeats fixed transforms on /tf."""
    rows = [*odometry("/odom", "map", "base"), *clouds("/points", "os")]
    for k, stamp in enumerate(STAMPS):
        X = X_BS @ yaw_pose(0.0, 0.0, 0.0, 0.01 * k * is_moving)
        edges = [
            transform("map", "base", X_WB(stamp), stamp),
            transform("base", "os", X, stamp),
        ]
        rows.append(("/tf", STATIC, stamp, {"transforms": edges}))
    drive = open_drive(write_bag(tmp_path / "ride.bag", rows))
    np.testing.assert_allclose(drive.X_BS, ID if is_moving else X_BS, atol=1e-9)
    said = "and it moves on /tf;" if is_moving else "mounted as /tf says"
    assert said in "; ".join(drive.notes)


def test_beams_without_a_return_are_left_out(tmp_path):
    """Ouster and Livox write points at the origin for them."""
    rows = [*odometry("/odom", "map", "os", X_BS)]
    for name, every in (
        ("/ouster", clouds("/ouster", "os", "x y z intensity t")),
        ("/livox", livox("/livox", "os")),
    ):
        for _, kind, stamp, fields in every:
            if name == "/ouster":
                data = fields["data"].reshape(-1, fields["point_step"]).copy()
                data[::2] = 0
                fields = {**fields, "data": data.ravel()}
            else:
                points = [dict(one) for one in fields["points"]]
                for one in points[::2]:
                    one |= {"x": 0.0, "y": 0.0, "z": 0.0}
                fields = {**fields, "points": points}
            rows.append((name, kind, stamp, fields))
    path = write_bag(tmp_path / "a", rows)
    for name in ("/ouster", "/livox"):
        drive = open_drive(path, name)
        seen = poses.transform(drive.X_WS[3], xyz(drive.scan(3)))
        np.testing.assert_allclose(seen, p_WP[1::2], atol=1e-4)


@pytest.mark.parametrize("second_ns", [10**8, 9 * 10**9, 11 * 10**9])
def test_a_clock_may_begin_at_zero(tmp_path, second_ns):
    """As Gazebo's; a zero among times since 1970 is no time."""
    scan, stamps = points_of(ID), [0, second_ns, second_ns + 1]
    X = [yaw_pose(1.0 * k, 0.0, 0.0, 0.0) for k in range(3)]
    write_recording(tmp_path / "a", [scan] * 3, X, stamps_ns=stamps)
    if second_ns < 10**10:
        assert open_drive(tmp_path / "a").stamps_ns.tolist() == stamps
        return
    with pytest.raises(InputError, match="a message has no stamp"):
        _ = open_drive(tmp_path / "a").stamps_ns


def test_registered_clouds_far_from_the_origin_are_coarse(tmp_path):
    """As clouds of float32 in UTM coordinates."""
    path = write_bag(tmp_path / "a", [
        *clouds("/points", "map", in_world=True),
        *odometry("/odom", "map", "os", X_BS)])  # fmt: skip
    assert not any("steps of" in one for one in open_drive(path).notes)
    rows = []
    for name, kind, stamp, fields in clouds("/points", "map", in_world=True):
        data = fields["data"].view("<f4").reshape(NUM_POINTS, -1) + 4e6
        rows.append(
            (name, kind, stamp, {**fields, "data": data.view("u1").ravel()})
        )
    path = write_bag(tmp_path / "b", [
        *rows, *odometry("/odom", "map", "os", X_BS, away=4e6)])  # fmt: skip
    assert any(
        "float32 has steps of 0.25 m" in x for x in open_drive(path).notes
    )


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_single_file_is_read_whatever_version_its_list_has(tmp_path, storage):
    entries = [*clouds("/points", "os"), *odometry("/odom", "map", "os", X_BS)]
    path = write_bag(tmp_path / "ride", entries, storage)
    text = (path / "metadata.yaml").read_text()
    assert "version: 8" in text
    text = text.replace("version: 8", "version: 10", 1)
    (path / "metadata.yaml").write_text(text)
    assert len(open_drive(path)) == NUM_SCANS


@pytest.mark.parametrize("gap", [0.0, -1.0, np.inf, np.nan])
def test_a_gap_that_is_none_is_refused(tmp_path, gap):
    path = session(tmp_path / "a.bag", 0.0)
    with pytest.raises(InputError, match=r"--pose-gap: .* is not above 0"):
        open_drive(path, pose_gap=gap)


def test_a_bag_of_ros_1_that_is_cut_off_names_its_cure(tmp_path):
    path = write(tmp_path, [*clouds("/points", "os")], ending=".bag")
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    said = r"ride_0.bag: the bag cannot be read .* \(rosbag reindex FILE"
    with pytest.raises(InputError, match=said):
        open_drive(path)


def session(
    path,
    later_s,
    away=0.0,
    topic="/points",
    frame="odom",
    logged_later_ns=0,
    **options,
):
    """Writes a bag that begins later, and elsewhere."""
    later = int(later_s * 10**9)
    entries = [
        (name, kind, stamp + later, moved_to(fields, stamp + later, away))
        for name, kind, stamp, fields in [
            *clouds(topic, "os"),
            *odometry("/odometry", frame, "os", X_BS),
        ]
    ]
    entries.sort(key=lambda one: one[2])
    log_times = [one[2] + logged_later_ns for one in entries]
    return write_bag(path, entries, log_times=log_times, **options)


def moved_to(fields, stamp_ns, away):
    fields = {
        **fields,
        "header": header(stamp_ns, fields["header"]["frame_id"]),
    }
    if "pose" in fields and away:
        of_pose = dict(fields["pose"]["pose"])
        x, y, z = of_pose["position"]
        of_pose["position"] = [x + away, y, z]
        fields["pose"] = {"pose": of_pose}
    return fields


def test_files_that_continue_each_other_are_one_drive(tmp_path):
    days = tmp_path / "ride"
    days.mkdir()
    # The files of ROS 1's `rosbag record --split` overlap a little.
    for k in range(3):
        session(days / f"ride_{k}.bag", 1.25 * k, 3.0 * k)
    drive = open_drive(days)
    assert len(drive) == 3 * NUM_SCANS
    assert np.ptp(drive.stamps_ns) == 3_600_000_000
    said = "3 files are read as one recording: ride_0.bag ride_1.bag ride_2.bag"
    assert said in drive.notes[0]


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (
            {"later_s": 86400.0},
            r"a\.bag and b\.bag have 863\d\d s between them",
        ),
        ({"later_s": 7.0}, r"have 6 s between them"),
        ({"later_s": 0.0}, "are of the same time"),
        ({"later_s": 2.0, "topic": "/rear"}, "other topics of point clouds"),
        ({"later_s": 1.25, "away": -200.0}, r"the poses jump by 20\d\.\d m"),
    ],
)
def test_files_of_several_sessions_are_no_drive(tmp_path, options, why):
    session(tmp_path / "a.bag", 0.0)
    session(tmp_path / "b.bag", **options)
    with pytest.raises(InputError, match=rf"several recordings: .*{why}") as e:
        _ = open_drive(tmp_path).X_WS
    assert "give one of a.bag b.bag" in str(e.value)
    assert len(open_drive(tmp_path / "b.bag")) == NUM_SCANS


@pytest.mark.parametrize("storage", ["mcap", "sqlite3", "sqlite3-file"])
@pytest.mark.parametrize("away", [3.75, -200.0])
@pytest.mark.parametrize("logged_later_ns", [0, 400_000_000])
def test_files_of_rosbag2_are_joined_unless_the_poses_jump(
    tmp_path, storage, away, logged_later_ns
):
    """As after `ros2 bag reindex` of the files of two sessions."""
    paths = [tmp_path / "ride_0", tmp_path / "ride_1"]
    session(paths[0], 0.0, storage=storage, logged_later_ns=logged_later_ns)
    session(paths[1], 1.25, away, storage=storage)
    join_bags(*paths)
    if away > 0.0:
        assert len(open_drive(paths[0])) == 2 * NUM_SCANS
        return
    said = r"the poses jump by 20\d\.\d m .*; give one of ride_0\..* ride_1\."
    with pytest.raises(InputError, match=said):
        _ = open_drive(paths[0]).X_WS


def test_files_that_are_not_there_are_named(tmp_path):
    entries = [*clouds("/points", "os"), *odometry("/odom", "map", "os", X_BS)]
    path = write_bag(tmp_path / "ride", entries)
    text = (path / "metadata.yaml").read_text()
    two = "- ride.mcap\n  - gone.mcap"
    (path / "metadata.yaml").write_text(text.replace("- ride.mcap", two, 1))
    with pytest.raises(InputError, match=r"that are not there: gone\.mcap"):
        open_drive(path)


def test_what_is_no_bag_of_ros_1_is_not_reindexed(tmp_path):
    path = tmp_path / "ride.bag"
    path.write_text("This is a text.\n" * 100)
    with pytest.raises(InputError, match="does not begin as a bag") as error:
        open_drive(path)
    assert "reindex" not in str(error.value)


@pytest.mark.parametrize("name", ["ride.bag", "ride.mcap", "ride.db3"])
def test_a_pointer_of_git_lfs_is_named(tmp_path, name):
    (tmp_path / name).write_text(
        "version https://git-lfs.github.com/spec/v1\n"
        f"oid sha256:{'0' * 64}\nsize 123456\n"
    )
    for path in (tmp_path / name, tmp_path):
        with pytest.raises(InputError, match=rf"{name}: a pointer of Git LFS"):
            open_drive(path)


def test_topics_of_ros_1_are_named_in_its_words(tmp_path):
    path = session(tmp_path / "a.bag", 0.0)
    with pytest.raises(InputError, match="/odometry: nav_msgs/msg/Odo") as e:
        open_drive(path, lidar="/odometry")
    assert "cdr" not in str(e.value)


@pytest.mark.parametrize("options", [{}, {"lidar": "/velodyne"}])
def test_messages_of_ros_1_in_mcap_name_their_cure(tmp_path, options):
    """As `mcap convert ride.bag ride.mcap` writes them."""
    path = tmp_path / "ride.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros1")
        schema = writer.register_schema(
            "sensor_msgs/PointCloud2", "ros1msg", b"Header header"
        )
        channel = writer.register_channel("/velodyne", "ros1", schema)
        writer.add_message(channel, T0_NS, b"0", T0_NS)
        writer.finish()
    said = r"PointCloud2 in ros1.*ROS 1 are read in a \.bag only: give the one"
    with pytest.raises(InputError, match=said):
        open_drive(path, **options)
