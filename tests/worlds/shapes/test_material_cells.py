"""The cells `material` of the structure table, written and read."""

import pytest

from worlds.shapes import MATERIALS, StructureEntry, read_materials, shortened


@pytest.mark.parametrize(
    ("semantic_class", "parts", "cell"),
    [
        ("building", {"wall": "plaster", "roof": "plaster"}, ""),
        ("building", {"wall": "brick", "roof": "brick"}, "brick"),
        (
            "building",
            {"wall": "brick", "roof": "brick", "pane": "glass"},
            "brick pane=glass",
        ),
        (
            "building",
            {"pane_1": "glass", "pane_2": "glass", "wall": "plaster"},
            "glass wall=plaster",
        ),
        ("vegetation", {"crown": "leaves", "wood": "bark"}, "wood=bark"),
        ("terrain", {}, ""),
        ("pole", {"a b=c/1": "sheet", "d": "metal"}, "sheet d=metal"),
        ("pole", {"d": "metal", "a b": "sheet"}, "a%20b=sheet"),
    ],
)
def test_a_cell_has_the_materials_of_all_parts(semantic_class, parts, cell):
    written, entry = (
        StructureEntry(1, "one", semantic_class, materials=materials)
        for materials in (shortened(parts), read_materials(cell))
    )
    assert written.cells()["material"] == cell
    for part, material in parts.items():
        assert entry.material(part) is MATERIALS[material]


@pytest.mark.parametrize(
    "cell", ["", "brick", "pane=glass", "brick pane=glass"]
)
def test_a_cell_is_written_as_it_was_read(cell):
    entry = StructureEntry(1, "one", "building", materials=read_materials(cell))
    assert entry.cells()["material"] == cell


@pytest.mark.parametrize(
    ("cell", "fault"),
    [
        ("gold", r"no material 'gold' \(there are: asphalt,"),
        ("wall=", "no material '' .there are"),
        ("wall=brick wall=glass", "'wall=glass': a second material"),
        ("brick plaster", "'plaster': a second material"),
    ],
)
def test_wrong_cells_are_refused(cell, fault):
    with pytest.raises(ValueError, match=fault):
        read_materials(cell)
