"""Sensors at rates of their own, in recordings of a tiny drive."""

import json
import shutil

from helpers.tiny_drive import tiny_scenario, write_scenario
from mcap.reader import make_reader
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
import yaml

from cns_drake.export import export_drive
from cns_drake.recording import START_NS
from cns_drake.scenarios import check_files, load_scenario
from cns_drake.simulation import simulate
from cns_drake.studies import is_recorded
from evaluation.base import InputError
from evaluation.drives import McapDrive

KALIBR = {
    "accelerometer_noise_density": 0.01,
    "accelerometer_random_walk": 0.0002,
    "gyroscope_noise_density": 0.005,
    "gyroscope_random_walk": 4.0e-06,
    "rostopic": "/imu0",
    "update_rate": 250.0,
}
UNIT = {"preset": "vlp-16", "columns": 8}
FRAMES = 12
LIDARS = {
    "lidar": {**UNIT, "rate": 10, "range_noise": 0.02},
    "rear": {**UNIT, "rate": 20, "layout": "velodyne"},
    "slow": {
        **UNIT,
        "rate": 5,
        "layout": "autoware",
        "returns": "calibrated",
    },
}


def make(folder, **changes):
    folder.mkdir(exist_ok=True)
    kalibr = folder / "adis.yaml"
    kalibr.write_text(yaml.safe_dump(KALIBR))
    (folder / "structures.csv").write_text(
        "instance,name,class,reflectivity\n1,ground,road,0.5\n"
    )
    values = {
        "lidars": LIDARS,
        "imu": {"rate": 400, "kalibr": str(kalibr), "accelerometer_range": 50},
        "odometry": {"rate": 100},
        "frames": FRAMES,
    }
    return tiny_scenario(folder, **(values | changes))


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    return make(tmp_path_factory.mktemp("tiny"))


@pytest.fixture(scope="module")
def recording(scenario, tmp_path_factory):
    return simulate(scenario, tmp_path_factory.mktemp("whole")).folder


def stamps_ns(folder):
    """Returns topic -> times [ns] in the order of the file."""
    found = {}
    with open(folder / f"{folder.name}_0.mcap", "rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages(
            log_time_order=False
        ):
            times = found.setdefault(channel.topic, [])
            times.append(message.log_time - START_NS)
    assert all(times == sorted(times) for times in found.values())
    return found


def even(rate, end_ns):
    """Returns the times from zero to an end, that included [ns]."""
    return list(range(0, end_ns + 1, 10**9 // rate))


def test_every_topic_has_its_rate(recording):
    found = stamps_ns(recording)
    last_scan_ns = (FRAMES - 1) * 100_000_000
    # The slow LiDAR's last scan begins at 1 s and takes 0.2 s.
    complete_ns = 1_200_000_000
    assert found == {
        "/lidar/points": even(10, last_scan_ns),
        "/rear/points": even(20, last_scan_ns),
        "/rear/labels": even(20, last_scan_ns),
        "/slow/points": even(5, last_scan_ns),
        "/slow/labels": even(5, last_scan_ns),
        "/imu/data": even(400, complete_ns),
        "/odometry": even(100, complete_ns),
        "/tf": even(100, complete_ns),
        "/tf_static": [0],
    }


def test_samples_go_on_between_frames_and_after_the_last(tmp_path):
    changes = {"imu": {"rate": 125}, "odometry": {}, "frames": 5}
    scenario = make(tmp_path / "odd", lidars={"lidar": UNIT}, **changes)
    found = stamps_ns(simulate(scenario, tmp_path / "drives").folder)
    # 50 ms are no multiple of 8 ms, nor is the end of the last scan.
    assert found["/imu/data"] == even(125, 256_000_000)
    assert found["/odometry"] == even(20, 200_000_000)


@pytest.mark.parametrize("rate", [15, 20])
def test_tf_goes_on_to_the_end_of_a_distorted_scan(tmp_path, rate):
    """It puts right the last scan as well; other topics end with it."""
    unit = {"preset": "vlp-16", "columns": 8, "rate": rate}
    ends = {}
    for distorted in (False, True):
        lidar = unit | {"motion_distortion": distorted}
        changes = {"imu": {}, "odometry": {}, "frames": 3}
        scenario = make(
            tmp_path / str(distorted), lidars={"lidar": lidar}, **changes
        )
        found = stamps_ns(simulate(scenario, tmp_path / str(rate)).folder)
        ends[distorted] = {k: len(v) for k, v in found.items()}
        turn_ns = 1e9 / rate
        for topic in ("/tf", "/lidar/points"):
            expected = turn_ns * np.arange(len(found[topic]))
            np.testing.assert_array_equal(found[topic], np.rint(expected))
        shutil.rmtree(tmp_path / str(rate))
    same = {"/imu/data": 3, "/odometry": 3, "/lidar/points": 3, "/tf_static": 1}
    assert ends == {False: same | {"/tf": 3}, True: same | {"/tf": 4}}


def test_samples_enclose_every_scan(recording):
    for lidar in LIDARS:
        drive = McapDrive(recording, lidar)
        first, last = drive.imu["stamp_ns"][[0, -1]]
        for stamp_ns, scan in zip(drive.stamps_ns, drive, strict=True):
            assert first <= stamp_ns
            assert stamp_ns + scan["t"].max() <= last


def test_turns_take_their_time(recording):
    for lidar, config in LIDARS.items():
        t_ns = McapDrive(recording, lidar).scan(1)["t"]
        # The last of eight columns, of which some return nothing.
        assert 0.7e9 / config["rate"] < t_ns.max() < 1e9 / config["rate"]


def test_layouts_hold_the_same_points(recording, tmp_path):
    lidars = {"lidar": LIDARS["lidar"]} | {
        name: {**LIDARS[name], "layout": "cns"} for name in ("rear", "slow")
    }
    plain = simulate(make(tmp_path, lidars=lidars), tmp_path / "out").folder
    for lidar in ("rear", "slow"):
        one, other = (McapDrive(p, lidar) for p in (recording, plain))
        assert len(one) == len(other) > 3
        for scan, expected in zip(one, other, strict=True):
            assert len(scan) > 10
            for name in ("x", "y", "z", "intensity", "label"):
                np.testing.assert_array_equal(scan[name], expected[name])
            # Velodyne's driver counts from below.
            below = 15 - expected["ring"].astype(int)
            ring = below if lidar == "rear" else expected["ring"]
            np.testing.assert_array_equal(scan["ring"], ring)
            np.testing.assert_allclose(
                scan["t"].astype(float), expected["t"], rtol=0, atol=8
            )


def test_a_shorter_run_begins_alike(scenario, recording, tmp_path):
    short = scenario.model_copy(update={"frames": 5})
    cut = McapDrive(simulate(short, tmp_path).folder)
    whole = McapDrive(recording)
    # The recording ends when the longest of its scans is complete.
    assert len(cut.imu) == round(0.6 * 400) + 1
    np.testing.assert_array_equal(cut.imu, whole.imu[: len(cut.imu)])
    np.testing.assert_array_equal(
        cut.odometry, whole.odometry[: len(cut.odometry)]
    )


def test_errors_are_those_of_kalibrs_file(recording, tmp_path):
    """Differences from the drive without noise have Kalibr's statistics."""
    imu = {"rate": 400}
    ideal = simulate(make(tmp_path, imu=imu), tmp_path / "out").folder
    noisy, exact = (McapDrive(p).imu for p in (recording, ideal))
    for name, density in (("specific_force", 0.01), ("angular_velocity", 5e-3)):
        errors = noisy[name] - exact[name]
        expected = density * np.sqrt(400)
        # 1443 numbers of each kind.
        assert errors.std() == pytest.approx(expected, rel=0.06)
        # Drawn for each axis.
        axes = np.corrcoef(errors.T)[np.triu_indices(3, 1)]
        assert np.abs(axes).max() < 0.15


def test_messages_have_their_variances(recording):
    with AnyReader([recording]) as reader:
        imu = [one for one in reader.connections if one.topic == "/imu/data"]
        connection, _, data = next(reader.messages(imu))
        message = reader.deserialize(data, connection.msgtype)
    np.testing.assert_allclose(
        message.linear_acceleration_covariance,
        np.diag([0.01**2 * 400] * 3).ravel(),
    )
    np.testing.assert_allclose(
        message.angular_velocity_covariance,
        np.diag([0.005**2 * 400] * 3).ravel(),
    )
    np.testing.assert_array_equal(
        message.orientation_covariance, 1e-12 * np.eye(3).ravel()
    )


def test_kalibrs_file_travels_with_the_recording(recording, tmp_path):
    expected = KALIBR | {"update_rate": 400.0, "rostopic": "/imu/data"}
    assert yaml.safe_load((recording / "imu.yaml").read_text()) == expected
    assert yaml.safe_load(McapDrive(recording).kalibr) == expected
    for layout in ("cns", "kitti", "mulran", "tum"):
        drive = export_drive(McapDrive(recording), layout, tmp_path / layout)
        assert yaml.safe_load((drive / "imu.yaml").read_text()) == expected


def test_a_recording_can_be_simulated_again(scenario, recording, tmp_path):
    assert is_recorded(scenario, recording.parent)
    again = load_scenario(recording / "scenario.yaml")
    folder = simulate(again, tmp_path).folder
    name = "tiny_01_0.mcap"
    assert (folder / name).read_bytes() == (recording / name).read_bytes()


def test_another_noise_is_another_recording(scenario, recording, tmp_path):
    shutil.copytree(recording, tmp_path / "tiny_01")
    assert is_recorded(scenario, tmp_path)
    other = tmp_path / "other.yaml"
    other.write_text(json.dumps(KALIBR | {"gyroscope_noise_density": 1.0}))
    imu = scenario.imu.model_copy(update={"kalibr": str(other)})
    assert not is_recorded(scenario.model_copy(update={"imu": imu}), tmp_path)


def test_the_rate_may_be_kalibrs(tmp_path):
    scenario = make(tmp_path, imu={"kalibr": str(tmp_path / "adis.yaml")})
    folder = simulate(scenario, tmp_path / "out").folder
    assert stamps_ns(folder)["/imu/data"] == even(250, 1_200_000_000)


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"imu": {"rate": 300}}, r"imu: rate: 300 .* such as 256 or 320$"),
        ({"imu": {"rate": 2000}}, r"imu: rate: 2000 .* 20 to 1000 .* 1000$"),
        ({"imu": {"rate": 10}}, r"imu: rate: 10 .* such as 20$"),
        ({"odometry": {"rate": 50}}, r"odometry: rate: 50 .* 40 or 80$"),
        ({"lidars": {"lidar": {"rate": 0}}}, r"lidars\.lidar\.rate: "),
        ({"lidars": {"lidar": {"rate": 101}}}, r"lidars\.lidar\.rate: "),
        ({"lidars": {"lidar": {"rate": 7.5}}}, r"lidars\.lidar\.rate: "),
        (
            {"lidars": {"a": {"rate": 20}, "b": {"rate": 15}}},
            r"lidars: b\.rate: 15 does not divide 20",
        ),
        (
            {"lidars": {"lidar": {"rate": 7}}, "odometry": {"rate": 100}},
            r"odometry: rate: 100 .* multiple of 7 .* there is none$",
        ),
        ({"lidars": {"lidar": {"layout": "pcl"}}}, r"layout: .*'autoware'"),
    ],
)
def test_rates_that_cannot_be(tmp_path, changes, fault):
    with pytest.raises(InputError, match=fault):
        make(tmp_path, **changes)


@pytest.mark.parametrize(
    ("values", "fault"),
    [
        (None, r"imu\.kalibr: .*adis\.yaml: no such file"),
        ([1], r"adis\.yaml: not a mapping"),
        (KALIBR | {"update_rate": 333.0}, r"adis\.yaml: update_rate: 333 "),
        (KALIBR | {"noise": 1.0}, r"adis\.yaml: noise: "),
        (
            KALIBR | {"gyroscope_random_walk": -1.0},
            r"adis\.yaml: gyroscope_random_walk: ",
        ),
        (
            {"accelerometer_noise_density": 0.1},
            r"adis\.yaml: accelerometer_random_walk: Field required",
        ),
    ],
)
def test_files_of_kalibr_that_cannot_be_used(tmp_path, values, fault):
    scenario = make(tmp_path, imu={"kalibr": str(tmp_path / "adis.yaml")})
    if values is None:
        (tmp_path / "adis.yaml").unlink()
    else:
        (tmp_path / "adis.yaml").write_text(yaml.safe_dump(values))
    with pytest.raises(InputError, match=fault):
        check_files(scenario)


def test_paths_are_relative_to_the_scenario(tmp_path):
    scenario = make(tmp_path, imu={"kalibr": "adis.yaml"})
    read = load_scenario(write_scenario(scenario, tmp_path))
    assert read.imu.kalibr == str((tmp_path / "adis.yaml").resolve())
