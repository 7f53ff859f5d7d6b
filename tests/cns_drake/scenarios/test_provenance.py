"""What a recording was made from and with."""

import importlib.metadata
import shutil

from helpers.tiny_drive import tiny_scenario
import pytest

from cns_drake.base.errors import InputError
from cns_drake.scenarios.provenance import (
    combined_digest,
    dependency_versions,
    digest_inputs,
)

INCLUDE = "<include><uri>{}</uri></include>"


@pytest.fixture
def scenario(tmp_path):
    """A world that includes a model, which has a mesh, and odd names."""
    folder = tmp_path / "world"
    (folder / "models" / "hut").mkdir(parents=True)
    scenario = tiny_scenario(folder)
    world = folder / "tiny.sdf"
    uris = [
        " models/hut/hut.sdf ",
        "tiny.sdf",
        "models",
        "package://far/away.sdf",
        "none.obj",
        "/dev/zero",
        "x" * 5000,
    ]
    world.write_text(world.read_text() + "".join(map(INCLUDE.format, uris)))
    (folder / "models/hut/hut.sdf").write_text("<uri>roof.obj</uri>")
    (folder / "models/hut/roof.obj").write_text("v 0 0 0")
    return scenario


def test_which_files_count(scenario, tmp_path):
    before = digest_inputs(scenario)
    assert before.keys() == {"world", "vehicle", "waypoints"}
    assert all(len(digest) == 64 for digest in before.values())
    folder = tmp_path / "world"
    (folder / "unrelated.obj").write_text("v 0 0 0")
    assert digest_inputs(scenario) == before
    for name, changed in [
        ("tiny.sdf", "world"),
        ("models/hut/hut.sdf", "world"),
        ("models/hut/roof.obj", "world"),
        ("tiny.csv", "waypoints"),
    ]:
        text = (folder / name).read_text()
        (folder / name).write_text(text + "\n")
        after = digest_inputs(scenario)
        assert after[changed] != before[changed]
        assert {**after, changed: ""} == {**before, changed: ""}
        assert combined_digest(after) != combined_digest(before)
        (folder / name).write_text(text)
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
