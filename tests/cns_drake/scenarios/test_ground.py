"""Waypoints without heights lie on the ground of their world."""

import numpy as np
import pytest

from cns_drake.base import InputError
from cns_drake.scenarios import ground_notes, load_scenario, plan_drive

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


def test_two_surfaces_of_which_none_is_at_zero_need_z(scenario):
    drive = scenario(YARD + DECK, "x,y\n0,0\n30,0\n60,0\n")
    with pytest.raises(InputError, match=r"no column z.*9\.00 and 5\.00 m"):
        plan_drive(drive)
    drive = scenario(YARD + DECK, "x,y,z\n0,0,5\n30,0,5\n60,0,5\n")
    np.testing.assert_array_equal(heights(drive), 5.0)


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
