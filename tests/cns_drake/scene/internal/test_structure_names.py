"""What the names of geometries and structures say."""

import pytest

from cns_drake.scene import StructureEntry, kind_in_name, structure_name
from cns_drake.scene.structure_names import part_name


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
    ("geometry", "structure", "part"),
    [
        ("city::tower_017/storey_03", "tower_017", "storey_03"),
        ("left::gripper::finger", "gripper", "finger"),
        ("bench", "bench", "bench"),
    ],
)
def test_a_name_has_a_structure_and_a_part(geometry, structure, part):
    assert structure_name(geometry) == structure
    assert part_name(geometry) == part


def test_a_structure_may_have_its_whole_name():
    name = "left::gripper::finger"
    assert structure_name(name, is_scoped=True) == "left::gripper"
