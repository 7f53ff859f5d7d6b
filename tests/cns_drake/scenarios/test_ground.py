"""Waypoints without heights lie on the ground of their world."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cns_drake.scenarios import ground_notes, load_scenario, plan_drive
from evaluation.base import InputError

BOX = (
    "<model name='{}'><static>1</static><pose>{} 0 0 0</pose><link name='l'>"
    "<visual name='v'><geometry><box><size>{}</size></box></geometry></visual>"
    "</link></model>"
)
# Its upper side is at 5 m.
YARD = BOX.format("yard", "30 0 4.5", "200 200 1")
# From 8 to 9 m above the middle of the way.
DECK = BOX.format("deck", "30 0 8.5", "20 20 1")
STREET = BOX.format("street", "30 0 -0.5", "200 200 1")


@pytest.fixture
def scenario(tmp_path):
    def make(world, lines, more=""):
        (tmp_path / "w.sdf").write_text(
            f"<sdf version='1.9'><world name='w'>{world}</world></sdf>"
        )
        (tmp_path / "p.csv").write_text(lines)
        (tmp_path / "d.yaml").write_text(
            f"world: w.sdf\nwaypoints: p.csv\nspeeds: {{cruise: 8}}\n{more}"
        )
        return load_scenario(tmp_path / "d.yaml")

    return make


def heights(scenario):
    trajectory = plan_drive(scenario)
    times = np.linspace(0.0, trajectory.duration, 20)
    return trajectory.poses(times)[1][:, 2]


def test_the_ground_gives_heights_that_the_file_lacks(scenario):
    drive = scenario(YARD, "x,y\n0,0\n60,0\n")
    np.testing.assert_array_equal(heights(drive), 5.0)
    assert ground_notes(drive, plan_drive(drive)) == ()


def test_level_ground_is_at_zero_below_a_deck(scenario):
    drive = scenario(STREET + DECK, "x,y\n0,0\n30,0\n60,0\n")
    np.testing.assert_array_equal(heights(drive), 0.0)


def test_two_surfaces_along_the_whole_path_need_z(scenario):
    deck = BOX.format("deck", "30 0 8.5", "90 20 1")
    drive = scenario(YARD + deck, "x,y\n0,0\n30,0\n60,0\n")
    with pytest.raises(InputError, match=r"no column z.*9\.00 and 5\.00 m"):
        plan_drive(drive)
    drive = scenario(YARD + deck, "x,y,z\n0,0,5\n30,0,5\n60,0,5\n")
    np.testing.assert_array_equal(heights(drive), 5.0)


@pytest.mark.parametrize(
    ("move", "turn_deg"),
    [
        *(((0, 0, up), 0) for up in (-300, -20, 0, 500)),
        ((10_000, -10_000, 0), 0),
        ((0, 0, 0), 37),
    ],
)
def test_a_world_that_is_moved_is_the_same(scenario, move, turn_deg):
    """The street dips and rises, also below a deck and beside a hole."""
    turn = Rotation.from_euler("z", turn_deg, degrees=True)

    def box(name, place, size):
        x, y, z = turn.apply(place) + move
        pose = f"{x} {y} {z} 0 0 {np.radians(turn_deg)}"
        return BOX.replace("{} 0 0 0", "{}").format(name, pose, size)

    def way(step):
        places = [(x, 0, 0) for x in range(0, 61, step)]
        rows = (turn.apply(places) + move)[:, :2]
        return "x,y\n" + "".join(f"{x},{y}\n" for x, y in rows)

    world = "".join(
        box(f"s{k}", (8 * k, 0, 0.2 * (k % 3) - 0.5), "8 9 1")
        for k in range(9)
        if k != 6
    ) + box("deck", (28, 0, 8.5), "20 20 1")
    plan = plan_drive(scenario(world, way(60)))
    times = np.linspace(0.0, plan.duration, 60)
    path = turn.inv().apply(plan.poses(times)[1] - move)
    x, z = path[:, 0], path[:, 2]
    inside = np.abs((x + 4) % 8 - 4) < 1.9
    inside &= (x < 42) | (x > 54)
    level = 0.2 * (np.rint(x / 8) % 3)
    np.testing.assert_allclose(path[:, 1], 0.0, atol=1e-9)
    np.testing.assert_allclose(z[inside], level[inside], atol=0.05)
    # Waypoints may be dense or not.
    other = plan_drive(scenario(world, way(5))).poses(times)[1]
    np.testing.assert_allclose(turn.inv().apply(other - move), path, atol=1e-6)


@pytest.mark.parametrize(
    ("z", "said"),
    [
        (5.0, None),
        (5.4, None),
        (4.0, "1.00 m below the ground"),
        (6.5, "1.50 m above the ground"),
    ],
)
def test_a_car_off_the_ground_is_noted(scenario, z, said):
    drive = scenario(YARD, f"x,y,z\n0,0,{z}\n60,0,{z}\n")
    notes = " ".join(ground_notes(drive, plan_drive(drive)))
    assert (said in notes) if said else not notes


def test_a_path_without_ground_is_noted(scenario):
    far = BOX.format("far", "0 900 0", "1 1 1")
    drive = scenario(far, "x,y\n0,0\n60,0\n")
    np.testing.assert_array_equal(heights(drive), 0.0)
    (note,) = ground_notes(drive, plan_drive(drive))
    assert "no ground is below 100% of the path" in note


def test_model_paths_are_relative_to_the_scenario(scenario, tmp_path):
    crate = tmp_path / "assets" / "crate"
    crate.mkdir(parents=True)
    (crate / "model.sdf").write_text(f"<sdf version='1.9'>{YARD}</sdf>")
    world = "<include><uri>model://crate</uri></include>"
    drive = scenario(world, "x,y\n0,0\n60,0\n", "model_paths: [assets]\n")
    assert drive.model_paths == (str(tmp_path / "assets"),)
    np.testing.assert_array_equal(heights(drive), 5.0)


def test_model_paths_must_exist_and_need_a_world(scenario, tmp_path):
    with pytest.raises(InputError, match=r"model_paths: .*no such folder"):
        scenario(YARD, "x,y\n0,0\n60,0\n", "model_paths: [nowhere]\n")
    (tmp_path / "e.yaml").write_text("base: downtown_01\nmodel_paths: [.]\n")
    with pytest.raises(InputError, match=r"model_paths.*for a world only"):
        load_scenario(tmp_path / "e.yaml")


def test_the_velocity_of_waypoints_limits_the_speed(scenario):
    rows = "x,y,velocity,lane\n0,0,4,a\n100,0,4,a\n150,0,12,a\n300,0,0,a\n"
    drive = scenario(BOX.format("s", "150 0 -0.5", "400 20 1"), rows)
    trajectory = plan_drive(drive)
    times = np.linspace(0.0, trajectory.duration, 4000)
    x = trajectory.poses(times)[1][:, 0]
    speed = np.gradient(x, times)
    slow = (x > 20.0) & (x < 95.0)
    assert speed[slow].max() < 4.05
    assert speed[slow].min() > 3.9
    # The scenario's own limit is 8 m/s.
    assert 7.5 < speed.max() < 8.05
    limit = np.interp(x, [0, 100, 150, 300], [4, 4, 12, 0])
    assert (speed < np.maximum(limit, 0.5) + 0.1).all()
    (note,) = ground_notes(drive, trajectory)
    assert note.endswith("p.csv: not used: the columns lane")


def test_a_velocity_below_zero_is_refused(scenario):
    drive = scenario(STREET, "x,y,velocity\n0,0,4\n60,0,-1\n")
    with pytest.raises(InputError, match=r"line 3: velocity: -1 m/s is below"):
        plan_drive(drive)
