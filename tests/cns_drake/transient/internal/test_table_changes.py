"""Changes of a structure table."""

import pytest

from cns_drake.base import InputError
from cns_drake.scene import MAX_INSTANCE, StructureEntry, StructureTable
from cns_drake.transient.scene_editing import TableChanges


@pytest.fixture
def changes():
    oak = StructureEntry(4, "oak_1", "vegetation", materials={"stem": "bark"})
    return TableChanges(StructureTable([oak]))


def test_without_changes_the_entries_stay(changes):
    (oak,) = changes.changed_table()
    assert (oak.instance, oak.causes) == (4, ())
    assert oak.materials == {"stem": "bark"}


def test_each_cause_counts_once(changes):
    for cause in ("leaves", "snow", "leaves"):
        changes.add_cause("oak_1", cause)
    assert changes.changed_table()["oak_1"].causes == ("leaves", "snow")


def test_new_structures_follow_in_the_order_of_their_names(changes):
    changes.add_structure(StructureEntry(0, "shed_2", "building"))
    changes.add_structure(
        StructureEntry(0, "car_7", "car", 0.3, materials={"": "paint"})
    )
    table = changes.changed_table()
    assert [(one.instance, one.name) for one in table] == [
        (4, "oak_1"),
        (5, "car_7"),
        (6, "shed_2"),
    ]
    assert table["car_7"].reflectivity == 0.3
    assert table["car_7"].materials == {"": "paint"}


def test_a_renamed_part_keeps_its_material(changes):
    changes.rename_part("oak_1", "stem", "stem_")
    changes.set_material("oak_1", "stem_snow", "snow")
    assert changes.changed_table()["oak_1"].materials == {
        "stem": "bark",
        "stem_": "bark",
        "stem_snow": "snow",
    }


def test_there_may_be_more_structures_than_ids():
    last = StructureEntry(MAX_INSTANCE, "oak_1", "vegetation")
    changes = TableChanges(StructureTable([last]))
    changes.add_structure(StructureEntry(0, "oak_2", "vegetation"))
    with pytest.raises(InputError, match="more than instance ids can count"):
        changes.changed_table()
