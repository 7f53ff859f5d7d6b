"""The table that gives structures their class and instance id."""

import pytest

from evaluation.base import InputError
from worlds.shapes import StructureEntry, StructureTable, load_structure_table


def write(tmp_path, text):
    path = tmp_path / "structures.csv"
    path.write_text(text)
    return path


def test_reads_what_the_columns_say(tmp_path):
    path = write(
        tmp_path,
        "name,instance,class,x\noak_2,9,vegetation,1.5\nhall_1,3,building,2\n",
    )
    table = load_structure_table(path)
    assert [(e.instance, e.name, e.label) for e in table] == [
        (3, "hall_1", 50),
        (9, "oak_2", 70),
    ]


def test_reflectivities_are_optional(tmp_path):
    path = write(
        tmp_path,
        "instance,name,class,reflectivity\n1,a,building,0.8\n2,b,building,\n",
    )
    table = load_structure_table(path)
    assert [table[name].reflectivity for name in "ab"] == [0.8, None]


def test_a_table_may_say_the_kind(tmp_path):
    path = write(
        tmp_path,
        "instance,name,class,kind\n1,land_w5,terrain,park\n2,land_w6,terrain,\n",
    )
    table = load_structure_table(path)
    assert [one.kind for one in table] == ["park", "land"]


def test_an_entry_is_read_as_it_was_written(tmp_path):
    entry = StructureEntry(
        7,
        "land_w5",
        "terrain",
        0.25,
        materials={"": "paving", "edge": "kerb"},
        kind="park",
        tags=("old_town", "green"),
    )
    cells = entry.cells()
    path = write(tmp_path, f"{','.join(cells)}\n{','.join(cells.values())}\n")
    assert list(load_structure_table(path)) == [entry]


def test_unlisted_structures_get_free_ids_in_order():
    table = StructureTable([StructureEntry(5, "hall", "building")])
    completed = table.completed(["b", "hall", "a", "b"])
    assert [(e.instance, e.name) for e in completed] == [
        (5, "hall"),
        (6, "a"),
        (7, "b"),
    ]
    assert completed["a"].label == 0


def test_more_structures_than_ids():
    with pytest.raises(InputError, match="65536 structures"):
        StructureTable(()).completed(f"s{k}" for k in range(65536))
    assert len(list(StructureTable(()).completed(map(str, range(65535))))) == (
        65535
    )


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("instance,name\n1,a\n", "no column 'class'"),
        ("instance,name,class\nx,a,building\n", "line 2: instance: 'x'"),
        ("instance,name,class\n0,a,building\n", "line 2: instance: 0"),
        ("instance,name,class\n65536,a,building\n", "line 2: instance: 65536"),
        (
            "instance,name,class\n1,a,building\n1,b,building\n",
            "line 3: instance: 1",
        ),
        (
            "instance,name,class\n1,a,building\n2,a,building\n",
            "line 3: name: 'a'",
        ),
        (
            "instance,name,class\n1,a,castle\n",
            "line 2: class: no class 'castle'",
        ),
        *(
            (
                f"instance,name,class,reflectivity\n1,a,building,{value}\n",
                f"line 2: reflectivity: '{value}' is not a number from 0 to 1",
            )
            for value in ("dark", "1.01", "-0.01", "nan")
        ),
    ],
)
def test_faults_name_file_line_and_field(tmp_path, text, fault):
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=f"structures.csv: {fault}"):
        load_structure_table(path)
