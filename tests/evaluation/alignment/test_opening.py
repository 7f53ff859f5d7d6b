"""The verdict on what is compared, before anything is aligned."""

import json

from helpers.drive_files import T0_NS
from helpers.towns import TownDrive
import numpy as np
import pytest

from evaluation.alignment import WorldVerdict, open_pair, world_of_frames
from evaluation.base import InputError, from_xyz


def drive(name, frame="map", at=(0.0, 0.0), stamps=None, X_BS=None, files=()):
    X_WS = np.broadcast_to(np.eye(4), (5, 4, 4)).copy()
    X_WS[:, :2, 3] = np.array(at) + np.arange(5)[:, None]
    scan = from_xyz(np.ones((3, 3), np.float32))

    class Given(TownDrive):
        stamps_ns = np.arange(5) * 10**8 if stamps is None else stamps

    Given.X_BS = X_BS
    Given.files = files
    return Given(name, [scan] * 5, X_WS, frame)


def test_drives_in_a_shared_frame_stay_as_they_are():
    notes = []
    given = [drive("a"), drive("b")]
    opened = open_pair(given, on_note=notes.append)
    assert opened.drives == given
    assert opened.world.state == "shared"
    assert notes == ["world: all poses are in frame 'map', which drives share"]
    found = json.loads(json.dumps(opened.world.to_json()))
    assert found == {
        "shared": True,
        "aligned": False,
        "why": notes[0].removeprefix("world: "),
    }


@pytest.mark.parametrize("frame", ["odom", "camera_init", "map_local", ""])
def test_equal_names_of_local_frames_are_no_world(frame):
    """As of a data set of one's own, whose drives have no files."""
    with pytest.raises(InputError, match=rf"b: poses in frame '{frame}/b'"):
        open_pair([drive("a", frame), drive("b", frame)], when="never")
    one = drive("a", frame)
    assert open_pair([one, one], when="never").world.shared is True
    # These show nothing by which they could be aligned.
    notes = []
    with pytest.raises(InputError, match="cannot be aligned"):
        open_pair([one, drive("b", frame)], on_note=notes.append)
    assert notes[0].startswith("world: nothing says that these are one: a in")
    assert notes[0].endswith("aligned by their scans")


def test_a_map_in_both_scenarios_is_one_world():
    first, second, third = (drive(name, "odom") for name in "abc")
    for one, city in ((first, "town"), (second, "town"), (third, "village")):
        type(one).scenario = {"map": city}
    assert open_pair([first, second], when="never").world.shared is True
    with pytest.raises(InputError, match="through village"):
        open_pair([first, third])


@pytest.mark.parametrize(("away", "is_told"), [(195.0, False), (210.0, True)])
def test_drives_that_are_nowhere_near_are_told(away, is_told):
    why = open_pair([drive("a"), drive("b", at=(away, 0.0))]).world.why
    assert ("b is nowhere within" in why) == is_told


@pytest.mark.parametrize(("pause_s", "is_told"), [(9.9, False), (10.1, True)])
def test_a_pause_is_told(pause_s, is_told):
    stamps = T0_NS + np.cumsum([0, 10**8, round(pause_s * 1e9), 10**8, 10**8])
    notes = []
    open_pair([drive("a", stamps=stamps)] * 2, on_note=notes.append)
    told = [one for one in notes if "after scan 1, 10 s without a scan" in one]
    assert len(told) == is_told


@pytest.mark.parametrize(("away", "is_told"), [(6.9, False), (7.1, True)])
def test_poses_that_begin_anew_are_told(away, is_told):
    """A vehicle drives 5 m in 0.1 s at most; poses are off by 2 m at most."""
    one = drive("a")
    one.X_WS[:, :2, 3] = 0.0
    one.X_WS[2:, 0, 3] += away
    notes = []
    open_pair([one, one], on_note=notes.append)
    assert any("poses begin anew" in text for text in notes) == is_told
    one.X_WS[:, 0, 3] = 1000.0 * np.arange(5)
    open_pair([one, one], on_note=notes.append)
    assert notes[-1] == "a: moves at 10000 m/s; are the poses in metres?"


@pytest.mark.parametrize(("height", "is_told"), [(1.79, False), (1.81, True)])
def test_mounts_of_other_heights_are_told(height, is_told):
    X_BS = np.eye(4)
    X_BS[2, 3] = 1.6
    other = X_BS.copy()
    other[2, 3] = height
    notes = []
    given = [drive("a", X_BS=X_BS), drive("b", X_BS=other)]
    open_pair(given, on_note=notes.append)
    assert any("different heights" in one for one in notes) == is_told


def test_a_map_names_no_world(tmp_path):
    np.save(tmp_path / "map.npy", np.ones((3, 3)))
    notes = []
    given = [drive("a", "odom"), tmp_path / "map.npy"]
    world = open_pair(given, on_note=notes.append).world
    assert (world.shared, world.state) == (None, "unknown")
    assert "its coordinates are taken as those of a" in notes[0]
    maps = open_pair([tmp_path / "map.npy"] * 2).world
    assert "names no frame" in maps.why or "name no frame" in maps.why


def test_states_of_a_verdict():
    assert WorldVerdict(False, True, "").state == "aligned"
    assert WorldVerdict(True, False, "").state == "shared"
    assert WorldVerdict(None, False, "").state == "unknown"
    assert world_of_frames("ab", ["map", "map"]).shared is True
    found = world_of_frames("ab", ["odom/x/a.bag", "odom/x/b.bag"])
    assert found.shared is False
    assert WorldVerdict(True, False, "").doubt
    assert not WorldVerdict(True, True, "").doubt
    assert "a in frame 'odom' of /x/a.bag; b in frame" in found.why
