"""The inputs and libraries of a recording."""

import hashlib
import importlib.metadata
import shutil
import tracemalloc

from helpers.tiny_drive import tiny_scenario
import pytest

from cns_drake.scenarios import (
    combined_digest,
    dependency_versions,
    digest_file,
    digest_inputs,
)
from evaluation.base import InputError

MODEL = """<sdf version="1.9"><!-- <uri>left_out.obj</uri> --><model name="m">
<link name="l"><visual name="v"><geometry><mesh><uri>{}</uri></mesh></geometry>
<material><pbr><metal><albedo_map>wall.png</albedo_map></metal></pbr></material>
</visual></link></model></sdf>"""
# Files that a world reads, directly or not, with their content.
READ = {
    "models/hut/hut.sdf": MODEL.format("roof.obj"),
    "models/hut/roof.obj": "mtllib roof.mtl\nv 0 0 0\n",
    "models/hut/roof.mtl": "newmtl red\nmap_Kd -clamp on tiles.png\n",
    "models/hut/tiles.png": "pixels",
    "models/hut/wall.png": "more pixels",
    "shed/model.config": '<model><sdf version="1.9">shed.sdf</sdf></model>',
    "shed/shed.sdf": MODEL.format("<![CDATA[door & window.gltf]]>"),
    "shed/door & window.gltf": '{"buffers": [{"uri": "door.bin"}]}',
    "shed/door.bin": "vertices",
    "models/tree/tree.sdf": MODEL.format(" leaves.dae "),
    "models/tree/leaves.dae": "<a><init_from>leaf.png</init_from></a>",
    "models/tree/leaf.png": "green pixels",
    "a&b.obj": "v 0 0 0\n",
    "c#d.obj": "v 0 0 0\n",
}
UNREAD = ["left_out.obj", "models/hut/other.obj", "shed/notes.txt"]
URIS = [
    " models/hut/hut.sdf ",
    "shed",
    "model://tree",
    "a&amp;b.obj",
    "c&#x23;d.obj",
    "tiny.sdf",
    "package://far/away.sdf",
    "none.obj",
    "/dev/zero",
    "x" * 5000,
]


@pytest.fixture
def scenario(tmp_path):
    """A world that includes models, which have meshes, and odd names."""
    folder = tmp_path / "world"
    folder.mkdir()
    scenario = tiny_scenario(folder)
    world = folder / "tiny.sdf"
    named = "".join(f"<include><uri>{uri}</uri></include>" for uri in URIS)
    text = world.read_text()
    assert text.count("</world>") == 1
    world.write_text(text.replace("</world>", f"{named}</world>"))
    for name in (*READ, *UNREAD):
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(READ.get(name, "anything"))
    return scenario


@pytest.mark.parametrize("name", [*READ, "tiny.sdf"])
def test_each_file_that_a_world_reads_counts(scenario, tmp_path, name):
    before = digest_inputs(scenario)
    assert before.keys() == {"world", "vehicle", "waypoints"}
    assert all(len(digest) == 64 for digest in before.values())
    file = tmp_path / "world" / name
    file.write_text(file.read_text() + "\n")
    after = digest_inputs(scenario)
    assert after["world"] != before["world"]
    assert {**after, "world": ""} == {**before, "world": ""}
    assert combined_digest(after) != combined_digest(before)
    file.unlink()
    if name != "tiny.sdf":
        assert digest_inputs(scenario)["world"] != before["world"]


def test_what_a_world_does_not_read_does_not_count(scenario, tmp_path):
    before = digest_inputs(scenario)
    for name in UNREAD:
        (tmp_path / "world" / name).write_text("something else")
    assert digest_inputs(scenario) == before


def test_route_and_table_count(scenario, tmp_path):
    before = digest_inputs(scenario)
    folder = tmp_path / "world"
    route = folder / "tiny.csv"
    route.write_text(route.read_text() + "\n")
    after = digest_inputs(scenario)
    assert after["waypoints"] != before["waypoints"]
    assert {**after, "waypoints": ""} == {**before, "waypoints": ""}
    (folder / "structures.csv").write_text("instance,name,class\n")
    assert digest_inputs(scenario).keys() - before.keys() == {"structures"}


def test_where_the_files_lie_does_not_count(scenario, tmp_path):
    shutil.copytree(tmp_path / "world", tmp_path / "elsewhere")
    moved = scenario.model_copy(
        update={
            "world": str(tmp_path / "elsewhere" / "tiny.sdf"),
            "waypoints": str(tmp_path / "elsewhere" / "tiny.csv"),
        }
    )
    assert digest_inputs(moved) == digest_inputs(scenario)


def test_a_missing_file_is_named(scenario, tmp_path):
    (tmp_path / "world" / "tiny.csv").unlink()
    with pytest.raises(InputError, match=r"tiny\.csv: No such file"):
        digest_inputs(scenario)


def test_versions_name_what_can_change_a_byte():
    versions = dependency_versions()
    assert {"cns-drake", "python", "drake", "embreex", "numpy"} < set(versions)
    assert all(version[0].isdigit() for version in versions.values())


def test_packages_that_a_platform_lacks_have_no_version(monkeypatch):
    version = importlib.metadata.version

    def without_embree(name):
        if name == "embreex":
            raise importlib.metadata.PackageNotFoundError(name)
        return version(name)

    versions = dependency_versions()
    monkeypatch.setattr(importlib.metadata, "version", without_embree)
    del versions["embreex"]
    assert dependency_versions() == versions


def test_a_digest_holds_little_of_a_large_file(tmp_path):
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n")
    (tmp_path / "a.mtl").write_text("map_Kd a.png\n")
    with open(tmp_path / "a.png", "wb") as stream:
        stream.truncate(1 << 26)
    tracemalloc.start()
    try:
        found = digest_file(tmp_path / "a.obj")
        assert tracemalloc.get_traced_memory()[1] < 1 << 23
    finally:
        tracemalloc.stop()
    expected = hashlib.sha256()
    for name, content in (
        ("a.mtl", b"map_Kd a.png\n"),
        ("a.png", bytes(1 << 26)),
    ):
        expected.update(f"{name} {len(content)}\n".encode() + content)
    expected.update(b"mtllib a.mtl\n")
    assert found == expected.hexdigest()
