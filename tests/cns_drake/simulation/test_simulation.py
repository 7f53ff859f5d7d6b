"""Runs from a scenario to a recording, and their errors."""

from helpers.bag_recordings import contents
from helpers.small_map import scenario_values, write_small_map
import pytest
from rosbags.highlevel import AnyReader
import yaml

from cns_drake.scenarios import load_scenario, make_scenario
from cns_drake.simulation import load_stage, simulate
from cns_drake.studies import is_recorded, record_all
from evaluation.base import Cluster, InputError

TOPICS = ("/lidar/points", "/imu/data", "/odometry", "/tf")


@pytest.fixture
def scenario(small_map):
    values = scenario_values(small_map) | {"frames": 7}
    return make_scenario(values, "test")


def test_every_topic_has_every_frame(short_recording):
    with AnyReader([short_recording]) as reader:
        stamps = {topic: [] for topic in (*TOPICS, "/tf_static")}
        for connection, stamp, _ in reader.messages():
            stamps[connection.topic].append(stamp)
    expected = [1_700_000_000_000_000_000 + k * 50_000_000 for k in range(40)]
    for topic in TOPICS:
        assert stamps[topic] == expected
    assert stamps["/tf_static"] == expected[:1]


def test_progress_is_reported_to_the_last_frame(scenario, tmp_path):
    frames = []
    run = simulate(scenario, tmp_path, on_frame=lambda *a: frames.append(a))
    assert frames[-1] == (7, 7)
    assert run.num_frames == 7
    assert run.simulated_s == pytest.approx(0.3)


def test_same_scenario_same_bytes(scenario, tmp_path):
    """The number of threads that cast rays has no effect."""
    recordings = [
        simulate(scenario, tmp_path / name, num_threads=threads).folder
        for name, threads in (("a", 1), ("b", 3))
    ]
    for name in ("metropolis_04_0.mcap", "metadata.yaml", "scenario.yaml"):
        first, second = ((r / name).read_bytes() for r in recordings)
        assert first == second


def test_recorded_scenario_is_the_scenario(scenario, tmp_path):
    folder = simulate(scenario, tmp_path).folder
    assert load_scenario(folder / "scenario.yaml") == scenario


def test_without_a_number_the_whole_route_is_recorded(small_map, tmp_path):
    values = scenario_values(small_map)
    values["lidars"] = {"lidar": {"columns": 4}}
    # A short drive: from the end of the second leg's street on.
    values["route"] = values["route"][:1]
    values["route"][0]["start"] = 2.0
    scenario = make_scenario(values, "test")
    run = simulate(scenario, tmp_path)
    recorded = yaml.safe_load((run.folder / "scenario.yaml").read_text())
    assert recorded["frames"] == run.num_frames
    with AnyReader([run.folder]) as reader:
        odometry = [c for c in reader.connections if c.topic == "/odometry"]
        last = None
        for connection, _, data in reader.messages(odometry):
            last = reader.deserialize(data, connection.msgtype)
    # From rest to rest.
    assert abs(last.twist.twist.linear.x) < 0.15


def test_more_frames_than_the_route_has(small_map, tmp_path):
    values = scenario_values(small_map) | {"frames": 10**6}
    with pytest.raises(
        InputError, match=r"1000000 is too many: the drive has \d{4}"
    ):
        simulate(make_scenario(values, "test"), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_existing_recording_is_kept_unless_overwritten(scenario, tmp_path):
    folder = simulate(scenario, tmp_path).folder
    before = (folder / "metropolis_04_0.mcap").read_bytes()
    longer = scenario.model_copy(update={"frames": 9})
    with pytest.raises(InputError, match=r"metropolis_04.*--overwrite"):
        simulate(longer, tmp_path)
    assert (folder / "metropolis_04_0.mcap").read_bytes() == before
    simulate(longer, tmp_path, overwrite=True)
    assert load_scenario(folder / "scenario.yaml").frames == 9


def test_a_world_that_changes_under_its_reader_is_refused(
    tmp_path, monkeypatch
):
    """The recording would otherwise name a world that it does not show."""
    folder = write_small_map(tmp_path / "map")
    scenario = make_scenario(scenario_values(folder) | {"frames": 2}, "test")

    def load_and_change(plan, **options):
        world = load_stage(plan, **options)
        plan.scenario.world_file.write_text(
            plan.scenario.world_file.read_text() + "<!-- changed -->"
        )
        return world

    monkeypatch.setattr(
        "cns_drake.simulation.loaded_drive.load_stage", load_and_change
    )
    with pytest.raises(InputError, match=r"stage_\d\d\.sdf: changed while"):
        simulate(scenario, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_graphviz_shows_the_station(scenario, tmp_path):
    simulate(scenario, str(tmp_path), graphviz_file=f"{tmp_path}/station.dot")
    text = (tmp_path / "station.dot").read_text()
    for name in ("vehicle_motion", "lidar", "mcap_recorder"):
        assert name in text


def test_unwritable_page_is_found_before_the_drive(scenario, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file"):
        simulate(scenario, tmp_path, page_file=tmp_path / "file" / "x.html")
    assert not (tmp_path / "metropolis_04").exists()


@pytest.mark.slow
@pytest.mark.night
def test_jobs_record_side_by_side_and_skip_finished_ones(small_map, tmp_path):
    scenarios = [
        make_scenario(
            scenario_values(small_map)
            | {"name": f"drive_{k}", "frames": 3 + k}
            | {"lidars": {"lidar": {"columns": 16}}},
            "test",
        )
        for k in range(3)
    ]
    record_all(scenarios[:1], tmp_path, Cluster(1))
    alone = contents(simulate(scenarios[0], tmp_path / "alone").folder)
    beside = contents(tmp_path / "drive_0")
    # They differ in the path from there to the map.
    assert alone.pop("scenario.yaml") != beside.pop("scenario.yaml")
    assert alone == beside
    first = tmp_path / "drive_0" / "drive_0_0.mcap"
    inode = first.stat().st_ino
    record_all(scenarios, tmp_path, Cluster(2))
    assert first.stat().st_ino == inode
    assert all(is_recorded(scenario, tmp_path) for scenario in scenarios)
    changed = scenarios[1].model_copy(update={"frames": 5})
    assert not is_recorded(changed, tmp_path)
    record_all([changed], tmp_path, Cluster(1))
    assert is_recorded(changed, tmp_path)


def test_jobs_that_fail_are_named_and_do_not_stop_others(small_map, tmp_path):
    values = scenario_values(small_map) | {"frames": 2}
    good = make_scenario(values | {"name": "good"}, "test")
    bad = make_scenario(values | {"name": "bad", "stage": "99"}, "test")
    with pytest.raises(InputError, match=r"bad: .*no stage '99'"):
        record_all([bad, good], tmp_path, Cluster(1))
    assert is_recorded(good, tmp_path)
