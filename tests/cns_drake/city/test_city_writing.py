"""Writing a generated city: all files or none, and nothing stale."""

import os
import re

from helpers.small_city import write_small_city
import pytest
import typer

from cns_drake.base import InputError
from cns_drake.city import generate_city
from cns_drake.command_line import city

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """Returns the small city, generated over stale files."""
    folder = write_small_city(tmp_path_factory.mktemp("worlds") / "small")
    (folder / "meshes").mkdir()
    (folder / "meshes" / "stale.obj").write_text("v 0 0 0\n")
    (folder / "stage_77.sdf").write_text("stale")
    generate_city(folder)
    return folder


def test_only_the_city_is_left(world):
    names = {path.name for path in world.iterdir()}
    assert names == {
        "roads.yaml",
        "city.yaml",
        "stages.yaml",
        "structures.csv",
        "stage_01.sdf",
        "stage_02.sdf",
        "meshes",
    }
    meshes = [path.name for path in (world / "meshes").iterdir()]
    assert len(meshes) > 20
    assert "stale.obj" not in meshes
    assert all(name.endswith(".obj") for name in meshes)


def test_files_can_be_read_by_others(world):
    mode = (world / "stage_01.sdf").stat().st_mode & 0o777
    assert mode == 0o644


def test_generating_again_changes_nothing(world, tmp_path):
    again = write_small_city(tmp_path / "small")
    written = generate_city(again)
    assert len(written) > 20
    for path in written:
        other = world / path.relative_to(again)
        assert path.read_bytes() == other.read_bytes(), path.name


def test_check_is_silent_when_all_is_well(world, capsys):
    city(world, check=True)
    assert capsys.readouterr().out == ""


def test_check_names_what_would_change(world, capsys):
    changed = world / "structures.csv"
    stale = world / "meshes" / "old.obj"
    good = changed.read_bytes()
    changed.write_bytes(good + b"#")
    stale.write_text("")
    try:
        with pytest.raises(typer.Exit) as caught:
            city(world, check=True)
        assert caught.value.exit_code == 1
        assert capsys.readouterr().out == f"{stale}\n{changed}\n"
        assert changed.read_bytes() == good + b"#"
    finally:
        changed.write_bytes(good)
        stale.unlink()


@pytest.mark.parametrize(
    ("file", "old", "new", "fault"),
    [
        ("city.yaml", "at: [30, -21]", "at: [30, 9]", "buildings.0.at"),
        ("city.yaml", "archetype: office", "archetype: ofice", "ofice"),
        (
            "city.yaml",
            "object: statue,",
            "object: site_fence, parameters: {length: .inf},",
            "parameters.length: inf is no number up to 1000",
        ),
        ("city.yaml", "relief: 1.5", "relief: 1.0e+300", "relief: Input"),
        ("stages.yaml", "tree_002", "tree_902", "structure tree_902"),
        ("roads.yaml", "start: west", "start: vest", "roads.north.start"),
    ],
)
def test_bad_input_is_one_line_and_writes_nothing(
    tmp_path, file, old, new, fault
):
    folder = write_small_city(tmp_path / "small")
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        city(folder)
    message = str(caught.value)
    assert message.startswith(str(folder / file))
    assert fault in message
    assert "\n" not in message
    assert len(list(folder.iterdir())) == 3


def test_a_folder_that_is_none_is_named(tmp_path):
    roads = re.escape(str(tmp_path / "nowhere" / "roads.yaml"))
    with pytest.raises(InputError, match=roads):
        city(tmp_path / "nowhere")


def test_a_disk_that_fills_up_leaves_no_half_file(
    tmp_path, monkeypatch, capsys
):
    folder = write_small_city(tmp_path / "small")
    replace = os.replace
    calls = []

    def full(source, target):
        calls.append(target)
        if len(calls) == 5:
            raise OSError(28, "No space left on device", str(source))
        replace(source, target)

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(InputError, match="No space left on device"):
        generate_city(folder)
    assert list(folder.rglob("*.part")) == []
    assert len(list(folder.rglob("*.obj"))) <= 4


def test_a_plan_of_others_writes_nothing_outside(tmp_path):
    folder = write_small_city(tmp_path / "a" / "small")
    plan = folder / "city.yaml"
    text = plan.read_text()
    plan.write_text(text.replace("office, at", "office, kind: ../../e, at"))
    with pytest.raises(InputError, match=r"city\.yaml: .*kind: String should"):
        generate_city(folder)
    plan.write_text(text)
    others = tmp_path / "others"
    others.mkdir()
    (others / "mine.obj").write_text("mine")
    (folder / "meshes").symlink_to(others)
    with pytest.raises(InputError, match="meshes: a link instead of a folder"):
        generate_city(folder)
    assert [path.name for path in others.iterdir()] == ["mine.obj"]
