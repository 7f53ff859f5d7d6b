"""Exports, read back by our readers and by those of others."""

import io
import itertools
import json
import shutil

from helpers.bent_drive import NUM_SCANS, P_BS, QUAT_BS, write_drive
from helpers.contradictions import read_messages, write_messages
from helpers.drive_files import make_scan
from helpers.internal.eval_program import run_program
from helpers.internal.listening import Heard, listening
from helpers.towns import TownDrive
from mcap.reader import make_reader
from mcap.writer import Writer
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import yaml

from cns_drake.__main__ import main
from cns_drake.export import export_drive
from evaluation import open_drive
from evaluation.base import InputError
from evaluation.base import InputError as ReadingError
from evaluation.study import drives_by_map, find_recordings


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    return write_drive(tmp_path_factory.mktemp("recordings") / "town_07")


@pytest.fixture(scope="module")
def kitti(drive, tmp_path_factory):
    output = tmp_path_factory.mktemp("exports") / "kitti"
    assert (
        export_drive(open_drive(drive), "kitti", output)
        == output / "sequences/07"
    )
    return output


@pytest.fixture(scope="module")
def cns(drive, tmp_path_factory):
    output = tmp_path_factory.mktemp("exports") / "cns"
    assert export_drive(open_drive(drive), "cns", output) == output / "Town/07"
    return output


def assert_same_drive(read, recorded, fields):
    assert read.name == recorded.name
    assert read.world_frame == recorded.world_frame
    assert read.scenario == dict(recorded.scenario)
    np.testing.assert_allclose(read.X_WS, recorded.X_WS, rtol=0, atol=1e-9)
    assert len(read) == len(recorded)
    for ours, original in zip(read, recorded, strict=True):
        assert set(ours.dtype.names) == set(fields)
        for name in fields:
            np.testing.assert_array_equal(ours[name], original[name])


POSES = np.tile(np.eye(4), (2, 1, 1))
POSES[1, :3, 3] = 1.0, 2.0, 0.5
XYZI = ("x", "y", "z", "intensity")


def test_kitti_reads_back(drive, kitti):
    recorded = open_drive(drive)
    read = open_drive(kitti / "sequences/07")
    assert_same_drive(read, recorded, (*XYZI, "label", "instance"))
    since_start = recorded.stamps_ns - recorded.stamps_ns[0]
    np.testing.assert_array_equal(read.stamps_ns, since_start)
    assert read.instances == recorded.instances


def test_kitti_has_its_poses_where_semantic_kitti_has_them(drive, kitti):
    """Beside calib.txt: X_S0S = inv(Tr) X_C0C Tr, as its tools read them."""
    folder = kitti / "sequences/07"
    expected = open_drive(drive).X_WS
    expected = np.linalg.inv(expected[0]) @ expected
    X_CS = np.eye(4)
    for line in (folder / "calib.txt").read_text().splitlines():
        key, content = line.split(":")
        if key == "Tr":
            X_CS[:3] = np.array(content.split(), float).reshape(3, 4)
    X_C0C = np.tile(np.eye(4), (NUM_SCANS, 1, 1))
    X_C0C[:, :3] = np.loadtxt(folder / "poses.txt").reshape(-1, 3, 4)
    read = np.linalg.inv(X_CS) @ X_C0C @ X_CS
    np.testing.assert_allclose(read, expected, rtol=0, atol=1e-9)
    assert (folder / "poses.txt").read_bytes() == (
        kitti / "poses/07.txt"
    ).read_bytes()


def test_tum_by_plain_means(drive, tmp_path):
    """The vehicle drives as recorded, and the LiDAR stands fixed on it."""
    folder = export_drive(open_drive(drive), "tum", tmp_path / "tum")
    assert folder == tmp_path / "tum/town_07"
    recorded = open_drive(drive)
    vehicle = np.loadtxt(folder / "base_link.tum")
    lidar = np.loadtxt(folder / "lidar.tum")
    assert vehicle.shape == lidar.shape == (NUM_SCANS, 8)
    i = np.arange(NUM_SCANS)
    place = np.stack([150.0 + 3.0 * i, -40.0 + i * i, 0.0 * i + 0.5], axis=1)
    np.testing.assert_allclose(vehicle[:, 1:4], place, rtol=0, atol=1e-12)
    R_WB = Rotation.from_quat(vehicle[:, 4:])
    np.testing.assert_allclose(
        R_WB.as_matrix(),
        Rotation.from_euler("z", (2.0 + 0.3 * i)[:, None]).as_matrix(),
        rtol=0,
        atol=1e-12,
    )
    np.testing.assert_allclose(
        lidar[:, 1:4], place + R_WB.apply(P_BS), rtol=0, atol=1e-9
    )
    turned = (R_WB * Rotation.from_quat(QUAT_BS)).inv()
    angles = (turned * Rotation.from_quat(lidar[:, 4:])).magnitude()
    np.testing.assert_allclose(angles, 0.0, rtol=0, atol=1e-9)
    for name in ("base_link.tum", "lidar.tum"):
        stamps = [
            line.split()[0] for line in (folder / name).read_text().splitlines()
        ]
        # No digit is lost, because a float has fewer.
        assert [
            int(stamp.replace(".", "")) for stamp in stamps
        ] == recorded.stamps_ns.tolist()
        assert {len(stamp.split(".")[1]) for stamp in stamps} == {9}


@pytest.mark.slow
def test_kitti_by_the_loader_of_kiss_icp(drive, kitti):
    from kiss_icp.datasets.kitti import KITTIOdometryDataset

    recorded = open_drive(drive)
    dataset = KITTIOdometryDataset(kitti, "07")
    # The program corrects an error of KITTI's own sensor, which bends our
    # scans.
    dataset.correct_kitti_scan = lambda points: points
    X_S0W = np.linalg.inv(recorded.X_WS[0])
    np.testing.assert_allclose(
        dataset.gt_poses, X_S0W @ recorded.X_WS, rtol=0, atol=1e-9
    )
    np.testing.assert_allclose(
        np.ravel(dataset.get_frames_timestamps()),
        (recorded.stamps_ns - recorded.stamps_ns[0]) * 1e-9,
        rtol=0,
        atol=1e-9,
    )
    assert len(dataset) == NUM_SCANS
    for i, scan in enumerate(recorded):
        points, _ = dataset[i]
        expected = np.stack([scan[name] for name in "xyz"], axis=1)
        np.testing.assert_array_equal(points, expected)


def test_labels_as_semantic_kitti_has_them(drive, kitti):
    for i, scan in enumerate(open_drive(drive)):
        stored = np.fromfile(
            kitti / f"sequences/07/labels/{i:06d}.label", dtype=np.uint32
        )
        np.testing.assert_array_equal(stored & 0xFFFF, scan["label"])
        np.testing.assert_array_equal(stored >> 16, scan["instance"])


def test_camera_axes_are_right_down_forward(kitti):
    # The drive goes forward, along the camera's z, and bends to the left.
    rows = np.loadtxt(kitti / "poses/07.txt")
    np.testing.assert_allclose(rows[0].reshape(3, 4), np.eye(4)[:3], atol=1e-12)
    Tr = next(
        line.split()[1:]
        for line in (kitti / "sequences/07/calib.txt").read_text().splitlines()
        if line.startswith("Tr:")
    )
    X_CS = np.array(Tr, dtype=float).reshape(3, 4)
    forward, left, up = np.eye(3)
    np.testing.assert_array_equal(X_CS[:, :3] @ forward, [0, 0, 1])
    np.testing.assert_array_equal(X_CS[:, :3] @ left, [-1, 0, 0])
    np.testing.assert_array_equal(X_CS[:, :3] @ up, [0, -1, 0])
    np.testing.assert_array_equal(X_CS[:, 3], 0.0)


def test_cns_reads_back(drive, cns):
    recorded = open_drive(drive)
    read = open_drive(cns / "Town/07")
    assert_same_drive(read, recorded, XYZI)
    np.testing.assert_array_equal(read.stamps_ns, recorded.stamps_ns)


def test_cns_has_lidars_at_the_vehicle_and_none_below(tmp_path):
    """A mounting pose below the vehicle reads like the inverse of one above."""
    recording = write_drive(tmp_path / "town_01", p_BS=(0.2, 0.0, 0.0))
    read = open_drive(
        export_drive(open_drive(recording), "cns", tmp_path / "cns")
    )
    assert_same_drive(read, open_drive(recording), XYZI)
    recording = write_drive(tmp_path / "town_02", p_BS=(0.2, 0.0, -1e-3))
    with pytest.raises(InputError, match=r"town_02: .* z = -0\.001 m"):
        export_drive(open_drive(recording), "cns", tmp_path / "below")
    assert not (tmp_path / "below").exists()


def test_a_failed_export_leaves_earlier_drives(drive, tmp_path):
    first = export_drive(open_drive(drive), "kitti", tmp_path / "out")
    broken = TownDrive("n_08", [make_scan(np.ones((3, 3)))] * 2, POSES)
    broken.scan = lambda index: [][index]
    with pytest.raises(IndexError):
        export_drive(broken, "kitti", tmp_path / "out")
    assert [path.name for path in first.parent.iterdir()] == ["07"]
    assert (tmp_path / "out/export.yaml").is_file()


def test_cns_by_plain_means(drive, cns):
    """gt.csv has the vehicle's poses, transformation_lidar.yaml the LiDAR's."""
    recorded = open_drive(drive)
    rows = np.loadtxt(cns / "Town/07/gt.csv", delimiter=",")
    mount = yaml.safe_load((cns / "transformation_lidar.yaml").read_text())
    np.testing.assert_allclose(mount["translation"], P_BS, atol=1e-12)
    np.testing.assert_allclose(mount["rotation"], QUAT_BS, atol=1e-12)
    R_WB = Rotation.from_quat(rows[:, 4:])
    p_WS = rows[:, 1:4] + R_WB.apply(mount["translation"])
    R_WS = R_WB * Rotation.from_quat(mount["rotation"])
    np.testing.assert_allclose(p_WS, recorded.X_WS[:, :3, 3], atol=1e-9)
    np.testing.assert_allclose(
        R_WS.as_matrix(), recorded.X_WS[:, :3, :3], atol=1e-9
    )
    first = (cns / "Town/07/gt.csv").read_text().split(",")[0]
    assert int(first) == recorded.stamps_ns[0]


@pytest.mark.slow
def test_pcd_by_open3d(drive, cns):
    import open3d

    recorded = open_drive(drive)
    for stamp_ns, scan in zip(recorded.stamps_ns, recorded, strict=True):
        if len(scan) == 0:
            continue
        cloud = open3d.t.io.read_point_cloud(
            str(cns / f"Town/07/pcd/{stamp_ns}.pcd")
        )
        points = np.stack([scan[name] for name in "xyz"], axis=1)
        np.testing.assert_array_equal(cloud.point.positions.numpy(), points)
        np.testing.assert_array_equal(
            cloud.point["intensity"].numpy()[:, 0], scan["intensity"]
        )


def test_mulran_reads_back(drive, tmp_path):
    recorded = open_drive(drive)
    folder = export_drive(open_drive(drive), "mulran", tmp_path / "mulran")
    read = open_drive(folder)
    assert read.world_frame == "mulran/utm-52n"
    np.testing.assert_allclose(read.X_WS, recorded.X_WS, rtol=0, atol=1e-8)
    np.testing.assert_array_equal(read.stamps_ns, recorded.stamps_ns)
    assert read.scenario == dict(recorded.scenario)
    assert read.lidar_field == recorded.lidar_field
    for ours, original in zip(read, recorded, strict=True):
        for name in XYZI:
            np.testing.assert_array_equal(ours[name], original[name])


def test_mulran_by_plain_means(drive, tmp_path):
    """By the mount of calib_base2ouster.txt, turned by almost half a turn."""
    recorded = open_drive(drive)
    folder = export_drive(open_drive(drive), "mulran", tmp_path / "mulran")
    rows = np.loadtxt(folder / "global_pose.csv", delimiter=",", dtype=object)
    assert rows[:, 0].astype(int).tolist() == recorded.stamps_ns.tolist()
    X_UB = np.zeros((len(rows), 4, 4))
    X_UB[:, :3] = rows[:, 1:].astype(float).reshape(-1, 3, 4)
    X_UB[:, 3, 3] = 1.0
    X_BS = np.eye(4)
    turn = Rotation.from_euler("xyz", [0.0001, 0.0003, 179.6654], degrees=True)
    X_BS[:3, :3] = turn.as_matrix()
    X_BS[:3, 3] = 1.7042, -0.021, 1.8047
    X_US = X_UB @ X_BS
    X_US[:, :3, 3] -= 350_000.0, 4_020_000.0, 0.0
    np.testing.assert_allclose(X_US, recorded.X_WS, rtol=0, atol=1e-8)
    file = folder / "Ouster" / f"{recorded.stamps_ns[0]}.bin"
    values = np.fromfile(file, "<f4").reshape(-1, 4)
    scan = recorded.scan(0)
    for name, column in zip(XYZI, values.T, strict=True):
        np.testing.assert_array_equal(column, scan[name])


def test_imu_of_a_simulated_drive(short_recording, tmp_path):
    drive = export_drive(open_drive(short_recording), "cns", tmp_path / "cns")
    recorded = open_drive(short_recording)
    read = open_drive(drive)
    np.testing.assert_array_equal(read.imu, recorded.imu)
    assert len(read.imu) == 40
    np.testing.assert_allclose(read.X_WS, recorded.X_WS, atol=1e-9)
    np.testing.assert_array_equal(read.scan(39)["x"], recorded.scan(39)["x"])
    mount = yaml.safe_load(
        (tmp_path / "cns/transformation_imu.yaml").read_text()
    )
    assert mount["translation"] == [-1.0, 0.0, 1.6]


def test_same_recording_gives_same_bytes(drive, kitti, tmp_path):
    export_drive(open_drive(drive), "kitti", tmp_path / "again")
    files = [path for path in kitti.rglob("*") if path.is_file()]
    assert len(files) == 1 + 1 + 6 + 2 * NUM_SCANS
    for path in files:
        again = tmp_path / "again" / path.relative_to(kitti)
        assert again.read_bytes() == path.read_bytes()


@pytest.mark.slow
def test_command(drive, tmp_path, capsys):
    output = tmp_path / "out"
    words = ("export", drive, "--format", "kitti", "--output", output)
    status, out, err = run_program(capsys, "cns-drake", main, *words)
    assert (status, out) == (0, f"{output / 'sequences/07'}\n")
    assert err.splitlines()[-1] == (
        f"next: cns-eval tcr {drive} {output / 'sequences/07'}"
    )
    status, out, err = run_program(capsys, "cns-drake", main, *words)
    assert (status, out) == (2, "")
    assert err.splitlines()[-1] == (
        f"cns-drake: error: {output / 'sequences/07'}: a drive is"
        " there already; remove it or give another folder or --sequence"
    )


def test_several_drives_share_a_folder(drive, tmp_path):
    other = write_drive(tmp_path / "recordings" / "town_08")
    output = tmp_path / "output"
    for recording in (drive, other):
        export_drive(open_drive(recording), "cns", output)
    assert sorted(p.name for p in (output / "Town").iterdir()) == ["07", "08"]
    moved = write_drive(tmp_path / "recordings" / "town_09", p_BS=(0, 0, 2))
    with pytest.raises(InputError, match=r"lidar\.yaml: differs.*mount"):
        export_drive(open_drive(moved), "cns", output)
    assert not (output / "Town/09").exists()


def test_a_drive_is_not_replaced(drive, tmp_path):
    drive_folder = export_drive(open_drive(drive), "kitti", tmp_path / "output")
    (drive_folder / "times.txt").write_text("mine")
    with pytest.raises(
        InputError, match="sequences/07: a drive is there already"
    ):
        export_drive(open_drive(drive), "kitti", tmp_path / "output")
    assert (drive_folder / "times.txt").read_text() == "mine"


@pytest.mark.parametrize("format_name", ["cns", "kitti", "mulran", "tum"])
def test_foreign_folders_are_left_alone(drive, tmp_path, format_name):
    (tmp_path / "file").write_text("")
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos/one.jpg").write_text("")
    (tmp_path / "marked").mkdir()
    (tmp_path / "marked/export.yaml").write_text("format: [")
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign/export.yaml").write_text("format: [cns]")
    export_drive(
        open_drive(drive),
        "kitti" if format_name == "cns" else "cns",
        tmp_path / "other",
    )
    before = sorted(tmp_path.rglob("*"))
    for folder, fault in (
        ("file", "file: not a folder"),
        ("photos", "holds other files"),
        ("marked", "export.yaml: not readable as YAML"),
        ("foreign", "export.yaml: not written by an export"),
        ("other", "the folder holds"),
    ):
        with pytest.raises(InputError, match=fault):
            export_drive(open_drive(drive), format_name, tmp_path / folder)
    assert sorted(tmp_path.rglob("*")) == before


class StopError(Exception):
    pass


@pytest.mark.parametrize("format_name", ["cns", "kitti"])
def test_an_interrupted_export_has_no_final_name(drive, tmp_path, format_name):
    class Stopper(Heard):
        def doing(self, activity, done=0, total=0, unit=""):
            if (activity, done, total) == ("writing scans", 2, NUM_SCANS):
                raise StopError

    with pytest.raises(StopError), listening(Stopper()):
        export_drive(open_drive(drive), format_name, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("format_name", ["cns", "kitti"])
def test_a_full_disk_leaves_nothing_half(
    drive, tmp_path, monkeypatch, format_name
):
    written = 0
    original = type(tmp_path).write_bytes

    def write_bytes(path, data):
        nonlocal written
        written += 1
        if written == 4:
            raise OSError(28, "No space left on device")
        return original(path, data)

    monkeypatch.setattr(type(tmp_path), "write_bytes", write_bytes)
    with pytest.raises(InputError, match=r"07: No space left"):
        export_drive(open_drive(drive), format_name, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("format_name", "depth"),
    [
        *itertools.product(("cns", "kitti"), (".", "exports")),
        ("mulran", "."),
    ],
)
def test_a_report_finds_exports(tmp_path, format_name, depth):
    """It finds them like recordings, by the map and stage in their scenario."""
    for number in ("1", "2"):
        name = f"town_0{number}"
        recording = write_drive(
            tmp_path / "recordings" / name,
            attachments={
                "scenario.json": {"map": "town", "stage": f"s{number}"}
            },
        )
        export_drive(
            open_drive(recording), format_name, tmp_path / "in" / depth
        )
    (tmp_path / "in" / "notes").mkdir()
    (city,) = drives_by_map(find_recordings(tmp_path / "in"))
    assert city.name == "town"
    assert {stage: one.name for stage, one in city.stages.items()} == {
        "s1": "town_01",
        "s2": "town_02",
    }


def test_one_of_several_lidars(drive, tmp_path):
    rear = write_drive(
        tmp_path / "recordings" / "town_01", lidar_topic="/rear/points"
    )
    export_drive(open_drive(rear, "rear"), "kitti", tmp_path / "rear")
    with pytest.raises(
        InputError, match=r"no topic /side/points .*/rear/points"
    ):
        open_drive(rear, "side")


def add_topic(path, old, new):
    """Repeats the messages of a topic under another name."""
    content = path.read_bytes()
    with open(path, "wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="test")
        reader = make_reader(io.BytesIO(content))
        for one in reader.iter_attachments():
            writer.add_attachment(
                one.create_time,
                one.log_time,
                one.name,
                one.media_type,
                one.data,
            )
        ids = {}
        for schema, channel, message in reader.iter_messages():
            for topic in (channel.topic, new):
                if topic == new and channel.topic != old:
                    continue
                if topic not in ids:
                    schema_id = writer.register_schema(
                        schema.name, schema.encoding, schema.data
                    )
                    ids[topic] = writer.register_channel(
                        topic, "cdr", schema_id
                    )
                writer.add_message(
                    ids[topic],
                    message.log_time,
                    message.data,
                    message.publish_time,
                    message.sequence,
                )
        writer.finish()


def test_two_lidars_share_a_kitti_folder(tmp_path):
    recording = write_drive(tmp_path / "recordings" / "town_07")
    add_topic(recording / "town_07_0.mcap", "/lidar/points", "/rear/points")
    output = tmp_path / "kitti"
    for lidar, number in (("lidar", "07"), ("rear", "107")):
        opened = open_drive(recording, lidar)
        drive = export_drive(opened, "kitti", output)
        assert drive == output / "sequences" / number
        assert (output / f"poses/{number}.txt").is_file()
        with pytest.raises(InputError, match="is there already"):
            export_drive(opened, "kitti", output)
    names = [open_drive(drive).name for drive in sorted(drive.parent.iterdir())]
    assert names == ["town_07", "town_07_rear"]


def test_names_that_lead_elsewhere_are_refused(tmp_path):
    for place in ("..", "a b", "x/.."):
        drive = write_drive(
            tmp_path / "recordings" / "town_01",
            attachments={"scenario.json": {"map": place}},
        )
        with pytest.raises(InputError, match="cannot be the name of a folder"):
            export_drive(open_drive(drive), "cns", tmp_path / "out" / "deep")
        shutil.rmtree(tmp_path / "recordings")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("format_name", ["cns", "tum"])
def test_quaternions_are_of_unit_length(tmp_path, format_name):
    """This holds even if the source's are not; our own reader needs it."""
    recording = write_drive(tmp_path / "town_07")
    path = recording / "town_07_0.mcap"
    messages, attachments = read_messages(path.read_bytes())
    whole = open_drive(path).X_WS
    for one in messages:
        if one.topic == "/odometry":
            for name in "xyzw":
                quat = one.body.pose.pose.orientation
                setattr(quat, name, 3.0 * getattr(quat, name))
    path.write_bytes(write_messages(messages, attachments))
    folder = export_drive(open_drive(path), format_name, tmp_path / "out")
    if format_name == "cns":
        exported = open_drive(folder)
        np.testing.assert_allclose(exported.X_WS, whole, atol=1e-12)
    else:
        rows = np.loadtxt(folder / "base_link.tum")
        np.testing.assert_allclose(np.linalg.norm(rows[:, 4:], axis=1), 1.0)
    for name in "xyzw":
        setattr(messages[-2].body.pose.pose.orientation, name, 0.0)
    path.write_bytes(write_messages(messages, attachments))
    with pytest.raises(InputError, match="quaternion"):
        export_drive(open_drive(path), format_name, tmp_path / "new")
    assert not list((tmp_path / "new").glob("*/*"))


@pytest.mark.parametrize("format_name", ["cns", "kitti", "mulran"])
def test_a_drive_of_any_format(tmp_path, format_name):
    """Also of points alone, without a vehicle, a scenario, an intensity."""
    scans = [np.full(3, k, [(axis, "<f4") for axis in "xyz"]) for k in (1, 2)]
    drive, notes = TownDrive("hall_08", scans, POSES), []
    folder = export_drive(
        drive, format_name, tmp_path / "out", on_note=notes.append
    )
    read = open_drive(folder)
    np.testing.assert_allclose(read.X_WS, drive.X_WS, atol=1e-8)
    assert (read.scan(1)["x"] == 2.0).all()
    assert (read.scan(1)["intensity"] == 0.0).all()
    assert notes[-1] == "hall_08: points have no intensity; it is written as 0"
    assert (format_name == "cns") == ("no poses of the vehicle" in notes[0])


def test_the_trajectory_of_a_lidar_alone(tmp_path):
    drive = TownDrive("hall_08", [np.zeros(0)] * 2, POSES)
    folder = export_drive(drive, "tum", tmp_path / "out")
    assert [file.name for file in folder.iterdir()] == ["lidar.tum"]
    rows = np.loadtxt(folder / "lidar.tum")
    np.testing.assert_array_equal(rows[:, 1:4], POSES[:, :3, 3])
    with pytest.raises(InputError, match="empty: has no scans"):
        export_drive(TownDrive("empty", [], POSES[:0]), "tum", tmp_path / "no")


class TestReadingKittiExports:
    """Files beside KITTI's own that do not fit."""

    @pytest.fixture
    def folder(self, kitti, tmp_path):
        shutil.copytree(kitti, tmp_path / "copy")
        return tmp_path / "copy/sequences/07"

    def test_without_them_it_is_plain_kitti(self, folder):
        for name in ("first_pose.txt", "scenario.yaml", "structures.json"):
            (folder / name).unlink()
        shutil.rmtree(folder / "labels")
        drive = open_drive(folder)
        assert drive.name == "07"
        assert drive.world_frame == f"kitti{folder.resolve()}"
        assert drive.scenario is None
        assert drive.instances is None
        assert drive.scan(0).dtype.names == XYZI
        np.testing.assert_allclose(drive.X_WS[0], np.eye(4), atol=1e-12)

    def test_a_world_of_its_own_stays_one(self, folder, tmp_path):
        """Two drives whose poses begin at 0 are in one place only by chance."""
        notes = []

        def exported(drive, layout, name=""):
            output = tmp_path / (name or layout)
            return export_drive(drive, layout, output, on_note=notes.append)

        (folder / "first_pose.txt").unlink()
        drive = open_drive(folder)
        again = open_drive(exported(drive, "kitti"))
        assert again.world_frame == f"kitti{tmp_path / 'kitti/sequences/07'}"
        exported(drive, "mulran")
        assert "its world frame is not that" in notes.pop()
        poses = tmp_path / "poses.txt"
        np.savetxt(poses, drive.X_WS[:, :3].reshape(-1, 12))
        given = open_drive(folder, poses=poses)
        again = open_drive(exported(given, "kitti", "given"))
        assert again.world_frame == "map"
        assert any("delete it if each has its own" in note for note in notes)

    @pytest.mark.parametrize(
        "text", ["[1]", "a: [", "name: ../../x", "name: 'a b'", "\0"]
    )
    def test_scenario(self, folder, text):
        (folder / "scenario.yaml").write_text(text)
        with pytest.raises(ReadingError, match=r"scenario\.yaml: [^\n]*$"):
            open_drive(folder)

    @pytest.mark.parametrize("text", ["{}x", "7", json.dumps([{"name": "a"}])])
    def test_structures(self, folder, text):
        (folder / "structures.json").write_text(text)
        with pytest.raises(ReadingError, match=r"structures\.json: [^\n]*$"):
            _ = open_drive(folder).instances

    @pytest.mark.parametrize("text", ["1 2 3", "", "1 " * 12])
    def test_first_pose(self, folder, text):
        (folder / "first_pose.txt").write_text(text)
        with pytest.raises(ReadingError, match=r"first_pose\.txt: "):
            open_drive(folder)
