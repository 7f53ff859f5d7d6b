"""What the names of geometries and structures say."""

from helpers.small_map import box_visual, world_text
import pytest

from cns_drake.scene import load_world, read_perception_geometry, structure_name
from worlds.shapes import StructureEntry, kind_in_name


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("row_house_017", "row_house"),
        ("carriageway", "carriageway"),
        ("office_003_lot_02_bench", "bench"),
        ("market_hall_001_lot_11_city_car", "city_car"),
        ("tree_001_012y", "tree"),
        ("tree_n-12", "tree"),
        ("land_w25_2", "land"),
    ],
)
def test_a_name_begins_with_a_kind(name, kind):
    assert kind_in_name(name) == kind
    assert StructureEntry(1, name, "building").kind == kind


@pytest.mark.parametrize(
    ("geometry", "structure"),
    [
        ("city::tower_017/storey_03", "tower_017"),
        ("left::gripper::finger", "gripper"),
        ("bench", "bench"),
    ],
)
def test_a_name_begins_with_its_structure(geometry, structure):
    assert structure_name(geometry) == structure


def test_visuals_have_a_structure_and_a_part(tmp_path):
    path = tmp_path / "world.sdf"
    names = ["tower_017/storey_03", "bench"]
    path.write_text(
        world_text([box_visual(n, (0,) * 6, (1, 1, 1)) for n in names])
    )
    inspector = load_world(path).scene_graph.model_inspector()
    found = {
        (one.structure, one.part) for one in read_perception_geometry(inspector)
    }
    assert found == {("tower_017", "storey_03"), ("city", "bench")}


def test_a_structure_may_have_its_whole_name():
    name = "left::gripper::finger"
    assert structure_name(name, is_scoped=True) == "left::gripper"
