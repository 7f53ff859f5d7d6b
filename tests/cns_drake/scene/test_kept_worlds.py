"""Worlds that are parsed before a process forks."""

import os

from helpers.small_map import box_visual, world_text
import psutil
import pytest

from cns_drake.scene import kept_worlds
from cns_drake.scene.kept_worlds import keep_world, take_world

_MESH = "v 0 0 0\nv 1 0 0\nv 0 1 {}\nf 1 2 3\n"


def _box(name):
    return box_visual(name, [0.0] * 6, [1.0] * 3)


@pytest.fixture
def parsed(monkeypatch):
    """Returns the files of worlds that are parsed, as they are."""
    files = []
    parse_world = kept_worlds.parse_world

    def parse(sdf, **options):
        files.append(sdf.name)
        return parse_world(sdf, **options)

    monkeypatch.setattr(kept_worlds, "parse_world", parse)
    monkeypatch.setattr(kept_worlds, "_kept", {})
    return files


@pytest.fixture
def world(tmp_path):
    """Returns a world of two boxes and a mesh."""
    (tmp_path / "mesh.obj").write_text(_MESH.format(0))
    path = tmp_path / "world.sdf"
    path.write_text(
        world_text(
            [
                _box("one/part"),
                _box("two/part"),
                '<visual name="mesh"><geometry><mesh><uri>mesh.obj</uri></mesh>'
                "</geometry></visual>",
            ]
        )
    )
    return path


def test_a_kept_world_is_taken_once(world, parsed):
    keep_world(world)
    keep_world(world)
    assert len(parsed) == 1
    first = take_world(world)
    assert len(parsed) == 1
    second = take_world(world)
    assert len(parsed) == 2
    assert first.scene_graph is not second.scene_graph
    assert first.names == second.names
    assert len(first.names) == 3


def test_a_world_without_structures_is_another_one(world, parsed):
    keep_world(world, without=["one"])
    assert len(take_world(world).names) == 3
    assert len(parsed) == 2
    assert len(take_world(world, without=["one"]).names) == 2
    assert len(parsed) == 2


def test_a_whole_world_is_for_those_that_add_no_model(world, parsed):
    whole = keep_world(world, is_whole=True)
    assert whole.plant.is_finalized()
    more = take_world(world)
    assert not more.plant.is_finalized()
    assert len(parsed) == 2
    assert take_world(world, is_whole=True) is whole
    # Any kept world serves where no more models come.
    keep_world(world)
    take_world(world, is_whole=True)
    assert len(parsed) == 3


def test_model_paths_are_looked_at(world, parsed, tmp_path):
    keep_world(world)
    take_world(world, model_paths=[tmp_path])
    assert len(parsed) == 2


@pytest.mark.parametrize("name", ["world.sdf", "mesh.obj"])
def test_a_changed_file_is_read_again(world, parsed, name):
    keep_world(world)
    file = world.with_name(name)
    status = file.stat()
    file.write_text(file.read_text())
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns + 1))
    take_world(world)
    assert len(parsed) == 2
    keep_world(world)
    assert len(parsed) == 3


def test_few_worlds_are_kept(tmp_path, parsed, monkeypatch):
    monkeypatch.setattr(kept_worlds, "_MOST_KEPT", 2)
    worlds = [tmp_path / f"{k}.sdf" for k in range(3)]
    for file in worlds:
        file.write_text(world_text([_box("box")]))
        keep_world(file)
    for file in worlds:
        take_world(file)
    assert parsed == ["0.sdf", "1.sdf", "2.sdf", "0.sdf"]


def test_no_thread_starts(world, parsed):
    """A forked process would lack it."""
    before = psutil.Process().num_threads()
    keep_world(world)
    assert psutil.Process().num_threads() == before
