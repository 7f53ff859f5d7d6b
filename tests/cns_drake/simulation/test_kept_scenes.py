"""Ray scenes that are built before a process forks."""

import os

from helpers.small_city import ROADS
from helpers.small_map import write_small_map
from helpers.tiny_drive import tiny_scenario
import psutil
import pytest

from cns_drake.ray_casting import embree_hierarchy
from cns_drake.scene import kept_worlds
from cns_drake.simulation import kept_scenes
from cns_drake.simulation.simulated_drive import DriveSimulation

FRAMES = (0, 7, 3)


@pytest.fixture(autouse=True)
def nothing_kept(monkeypatch):
    monkeypatch.setattr(kept_worlds, "_kept", {})
    monkeypatch.setattr(kept_scenes, "_kept", {})


@pytest.fixture
def built(monkeypatch):
    """Returns the number of primitives of all that Embree builds."""
    numbers = []
    build = embree_hierarchy.EmbreeHierarchy._build

    def count(self, parts):
        numbers.append(sum(len(part.owners) for part in parts))
        return build(self, parts)

    monkeypatch.setattr(embree_hierarchy.EmbreeHierarchy, "_build", count)
    return numbers


def scans(drive):
    opened = drive()
    return [opened.scan(frame).tobytes() for frame in FRAMES]


@pytest.fixture(params=["plain", "traffic", "snow"])
def drive(request, tmp_path):
    """Returns a drive in a town that stays, has traffic, or snow."""
    changes = {
        "plain": {},
        "traffic": {"traffic": {"vehicles": 9, "walkers": 9}},
        "snow": {"transient": {"snow": 0.5}},
    }[request.param]
    town = write_small_map(tmp_path / "town")
    (town / "roads.yaml").write_text(ROADS)
    scenario = tiny_scenario(
        tmp_path, world=None, map=str(town), stage="04", frames=8, **changes
    )
    return DriveSimulation(scenario)


def test_scans_are_those_of_a_scene_built_alone(drive, built):
    alone = scans(drive)
    drive.load()
    drive.load()
    before = sum(built)
    assert scans(drive) == alone
    if drive.scenario.traffic.is_off and drive.scenario.transient.is_off:
        assert sum(built) == before
    # What was taken is not there any more.
    assert scans(drive) == alone
    assert sum(built) > before


def test_forked_processes_share_it(drive):
    alone = b"".join(scans(drive))
    drive.load()
    for _ in range(2):
        ours, theirs = os.pipe()
        child = os.fork()
        if child == 0:
            with open(theirs, "wb") as stream:
                stream.write(b"".join(scans(drive)))
            os._exit(0)
        os.close(theirs)
        with open(ours, "rb") as stream:
            assert stream.read() == alone
        assert os.waitpid(child, 0)[1] == 0


def test_no_thread_starts(tmp_path):
    """A forked process would lack it."""
    drive = DriveSimulation(tiny_scenario(tmp_path))
    before = psutil.Process().num_threads()
    drive.load()
    assert len(kept_scenes._kept) == 1
    assert psutil.Process().num_threads() == before


def test_a_changed_stage_is_built_anew(tmp_path):
    scenario = tiny_scenario(tmp_path, frames=8)
    drive = DriveSimulation(scenario)
    drive.load()
    before = scans(drive)
    drive.load()
    file = tmp_path / "tiny.sdf"
    file.write_text(file.read_text().replace("0 0 -0.5", "0 0 -0.25"))
    changed = scans(drive)
    assert changed != before
    kept_scenes._kept.clear()
    kept_worlds._kept.clear()
    assert scans(drive) == changed


def test_few_scenes_are_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(kept_scenes, "_MOST_KEPT", 2)
    drives = []
    for k in range(3):
        (tmp_path / str(k)).mkdir()
        drives.append(DriveSimulation(tiny_scenario(tmp_path / str(k))))
        drives[-1].load()
    assert len(kept_scenes._kept) == 2
    for drive in drives:
        drive()
    assert not kept_scenes._kept


def test_a_world_in_which_something_can_move_has_none(tmp_path):
    drive = DriveSimulation(tiny_scenario(tmp_path, frames=8))
    file = tmp_path / "tiny.sdf"
    text = file.read_text()
    file.write_text(text.replace("<static>true</static>", ""))
    alone = scans(drive)
    drive.load()
    assert not kept_scenes._kept
    assert scans(drive) == alone
