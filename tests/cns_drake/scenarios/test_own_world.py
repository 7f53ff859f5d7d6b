"""A user's own SDF world, driven along waypoints."""

import shutil

from helpers.bag_recordings import contents
from helpers.meshcat_pages import objects, read_commands, vertices
from helpers.small_map import box_visual, world_text
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
import yaml

from cns_drake.scenarios import load_scenario, plan_drive
from cns_drake.simulation import simulate
from evaluation.base import InputError
from evaluation.drives import open_drive

SPEEDS = {
    "cruise": 6.0,
    "longitudinal_acceleration": 1.5,
    "lateral_acceleration": 2.0,
}


@pytest.fixture
def yard(tmp_path):
    """A folder with a world, waypoints and a drive of them."""
    folder = tmp_path / "yard"
    folder.mkdir()
    visuals = [
        box_visual("ground/plate", (0, 0, -0.5, 0, 0, 0), (200, 200, 1)),
        box_visual("hall/body", (30, 25, 5, 0, 0, 0.3), (20, 12, 10)),
    ]
    (folder / "yard.sdf").write_text(world_text(visuals))
    (folder / "tour.csv").write_text("x,y\n-10,5\n40,5\n40,60\n")
    values = {
        "world": "yard.sdf",
        "waypoints": "tour.csv",
        "speeds": SPEEDS,
        "lidars": {"lidar": {"columns": 64}},
        "frames": 4,
    }
    (folder / "yard_01.yaml").write_text(yaml.safe_dump(values))
    return folder


def test_a_world_and_waypoints_give_a_recording(yard, tmp_path):
    scenario = load_scenario(yard / "yard_01.yaml")
    assert scenario.name == "yard_01"
    run = simulate(scenario, tmp_path / "out", page_file=tmp_path / "p.html")
    assert run.num_frames == 4
    assert load_scenario(run.folder / "scenario.yaml") == scenario
    described = yaml.safe_load((run.folder / "scenario.yaml").read_text())
    assert described.keys().isdisjoint({"map", "stage", "route"})
    with AnyReader([run.folder]) as reader:
        (odometry,) = (c for c in reader.connections if c.topic == "/odometry")
        _, _, data = next(reader.messages([odometry]))
        pose = reader.deserialize(data, odometry.msgtype).pose.pose
    position = [pose.position.x, pose.position.y, pose.position.z]
    np.testing.assert_allclose(position, [-10, 5, 0], atol=1e-9)


def test_nothing_depends_on_the_folder(yard, tmp_path):
    """World and recording are moved together; the bytes stay the same."""
    moved = tmp_path / "else" / "where"
    shutil.copytree(yard, moved)
    folders = [
        simulate(load_scenario(path / "yard_01.yaml"), output).folder
        for path, output in (
            (yard, yard / "out"),
            (moved, moved / "out"),
            (moved, tmp_path / "deep" / "down" / "out"),
        )
    ]
    first, second, third = map(contents, folders)
    assert first == second
    # Only the path to the world differs.
    assert first.pop("scenario.yaml") != third.pop("scenario.yaml")
    assert first == third
    assert load_scenario(folders[2] / "scenario.yaml").world == str(
        moved / "yard.sdf"
    )
    for data in first.values():
        assert str(tmp_path).encode() not in data


def test_a_drive_in_survey_coordinates_is_the_same(yard, tmp_path):
    """World, waypoints and drive are moved together, as far as UTM has them."""
    far = np.array([350_000.0, 4_020_000.0, 500.0])
    scenario = load_scenario(yard / "yard_01.yaml")
    near = open_drive(simulate(scenario, tmp_path / "near").folder)
    world = (yard / "yard.sdf").read_text()
    pose = "<pose>350000 4020000 500 0 0 0</pose><link"
    (yard / "yard.sdf").write_text(world.replace("<link", pose))
    waypoints = np.array([[-10, 5], [40, 5], [40, 60]]) + far[:2]
    np.savetxt(yard / "tour.csv", waypoints, delimiter=",")
    page = tmp_path / "page.html"
    run = simulate(scenario, tmp_path / "far", page_file=page)
    moved = open_drive(run.folder)
    expected = near.X_WS.copy()
    expected[:, :3, 3] += far
    np.testing.assert_allclose(moved.X_WS, expected, rtol=0, atol=1e-8)
    for a, b in zip(near, moved, strict=True):
        np.testing.assert_array_equal(a, b)
    drawn = objects(read_commands(page.read_text()))
    assert len(drawn) > 3
    for one in drawn.values():
        if one["type"] == "BufferGeometry":
            assert np.abs(vertices(one)).max() < 60_000.0


def test_waypoints_lead_through_a_map_as_well(yard, small_map):
    path = yard / "yard_01.yaml"
    values = yaml.safe_load(path.read_text())
    del values["world"]
    values |= {"map": str(small_map), "stage": "01"}
    path.write_text(yaml.safe_dump(values))
    scenario = load_scenario(path)
    assert scenario.world_file == small_map / "stage_01.sdf"
    start = plan_drive(scenario).pose(0.0).translation()
    np.testing.assert_allclose(start, [-10, 5, 0], atol=1e-9)


def test_the_drive_keeps_to_waypoints_and_speeds(yard):
    trajectory = plan_drive(load_scenario(yard / "yard_01.yaml"))
    # 50 m and 55 m, less the corner's 2 * 8 m replaced by a quarter circle.
    assert trajectory.length == pytest.approx(105 - 16 + 4 * np.pi, abs=0.3)
    end = trajectory.pose(trajectory.duration).translation()
    np.testing.assert_allclose(end, [40, 60, 0], atol=1e-9)
    t = np.arange(0, trajectory.duration, 0.01)
    speed = np.gradient(trajectory.travelled(t), t)
    assert 0.99 * 6.0 < speed.max() < 6.0 + 1e-3
    # Round the bend of 8 m with at most 2 m/s^2, but not much slower.
    corner = np.argmin(
        np.linalg.norm(trajectory.positions(t)[:, :2] - [40, 5], axis=1)
    )
    assert 3.6 < speed[corner] < 4.2


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"map": "metropolis", "stage": "04"}, r"world: give either a map"),
        (
            {"world": None},
            r"world: give either a map and its stage, or a world",
        ),
        ({"stage": "04"}, r"stage: give a map and its stage together"),
        ({"waypoints": None}, r"waypoints: give either a route or waypoints"),
        ({"aside": 0.5}, r"waypoints: aside is for a route"),
        (
            {"route": [{"road": "a", "direction": "forward", "lane": 1}]},
            r"route: a world has no roads, give waypoints instead",
        ),
        ({"world": "gone.sdf"}, r"world: .*gone\.sdf: no such file"),
        ({"waypoints": "gone.csv"}, r"waypoints: .*gone\.csv: no such file"),
        ({"waypoints": 7}, r"waypoints: not a text"),
    ],
)
def test_faults_name_the_field(yard, change, fault):
    path = yard / "yard_01.yaml"
    values = yaml.safe_load(path.read_text()) | change
    path.write_text(yaml.safe_dump(values))
    with pytest.raises(InputError, match=r"yard_01\.yaml: " + fault) as error:
        load_scenario(path)
    assert "\n" not in str(error.value)


def test_faults_in_the_waypoints_name_their_line(yard, tmp_path):
    (yard / "tour.csv").write_text("0,0\n50,0\nnorth,50\n")
    scenario = load_scenario(yard / "yard_01.yaml")
    with pytest.raises(InputError, match=r"tour\.csv: line 3: 'north'"):
        simulate(scenario, tmp_path / "out")
    assert not (tmp_path / "out").exists()
