"""The table of drives: right figures, and never stale ones."""

from dataclasses import replace
import shutil

from helpers.internal.listening import listening
from helpers.small_map import write_small_map
import pytest
import yaml

from cns_drake.scenarios import (
    count_frames,
    listed_drives,
    load_scenario,
    plan_drive,
    write_table,
)
from evaluation.base import InputError
from worlds.maps import MapFolder, recordable_drives, shipped_maps

# A box has twelve triangles.
BOX = 12


@pytest.fixture
def folder(tmp_path):
    """A map with two drives; the stage of a third one is missing."""
    folder = write_small_map(tmp_path / "boxes")
    for name in ("01", "04"):
        source = recordable_drives()[f"metropolis_{name}"]
        entries = yaml.safe_load(source.read_text()) | {"map": "."}
        path = folder / f"sequence_{name}.yaml"
        path.write_text(yaml.safe_dump(entries))
    text = (folder / "sequence_04.yaml").read_text()
    (folder / "sequence_05.yaml").write_text(text.replace("'04'", "'05'"))
    return folder


def measured(folder):
    """The rows, and the drives that were measured."""
    with listening() as heard:
        rows = listed_drives([folder])
    said = [one.partition("measuring ") for one in heard.activities]
    return rows, [name for _, found, name in said if found]


def test_figures_are_those_of_the_drive_and_the_stage(folder):
    rows, _ = measured(folder)
    assert [row.sequence for row in rows] == ["boxes_01", "boxes_04"]
    scenario = load_scenario(folder / "sequence_04.yaml")
    planned = plan_drive(scenario)
    assert rows[1].map == "boxes"
    assert rows[1].stage == "04"
    assert rows[1].frames == count_frames(scenario, planned)
    assert rows[1].length == pytest.approx(planned.length, abs=0.05)
    assert rows[1].duration == pytest.approx(planned.duration, abs=0.005)
    assert (rows[0].structures, rows[1].structures) == (20, 41)
    assert (rows[0].triangles, rows[1].triangles) == (20 * BOX, 41 * BOX)


def test_only_what_changed_is_measured_again(folder):
    write_table(folder)
    before, again = measured(folder)
    assert again == []
    stage = folder / "stage_01.sdf"
    shutil.copy(folder / "stage_04.sdf", stage)
    after, again = measured(folder)
    assert again == ["boxes_01"]
    assert after[0] == replace(
        before[0],
        checksum=after[0].checksum,
        structures=41,
        triangles=41 * BOX,
    )
    assert after[1] == before[1]
    roads = folder / "roads.yaml"
    roads.write_text(roads.read_text() + "# changed\n")
    assert measured(folder)[1] == ["boxes_01", "boxes_04"]


def test_a_drive_is_measured_again_when_its_base_changes(folder):
    path = folder / "sequence_04.yaml"
    base = path.rename(folder / "base.yaml")
    path.write_text("base: base.yaml")
    write_table(folder)
    before, again = measured(folder)
    assert again == []
    base.write_text(base.read_text() + "\nframes: 7\n")
    after, again = measured(folder)
    assert again == ["boxes_04"]
    assert (before[1].frames > 7, after[1].frames) == (True, 7)


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        pytest.param("sequence,map,stage", marks=pytest.mark.night),
        pytest.param("sequence,map,stage\nboxes_01\n", marks=pytest.mark.night),
        "sequence,map,stage,title\n\0,\x80",
    ],
)
def test_a_spoilt_table_is_measured_anew(folder, text):
    write_table(folder)
    good = MapFolder(folder).drive_table.read_bytes()
    MapFolder(folder).drive_table.write_bytes(text.encode("latin-1"))
    assert measured(folder)[1] == ["boxes_01", "boxes_04"]
    write_table(folder)
    assert MapFolder(folder).drive_table.read_bytes() == good


def test_a_drive_that_is_no_mapping_is_named(folder):
    (folder / "sequence_01.yaml").write_text("- a\n")
    with pytest.raises(InputError, match=r"sequence_01.yaml: not a mapping"):
        listed_drives([folder])


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(shipped_maps()))
def test_the_shipped_tables_are_up_to_date(name):
    folder = shipped_maps()[name]
    if not sorted(folder.glob("stage_*.sdf")):
        assert not MapFolder(folder).drive_table.exists()
        return
    _, again = measured(folder)
    assert again == []
