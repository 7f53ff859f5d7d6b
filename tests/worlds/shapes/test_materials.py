import numpy as np
import pytest
from shapely.geometry import box

from worlds.city import ARCHETYPES, sample
from worlds.shapes import (
    CLASS_IDS,
    MATERIALS,
    OBJECTS,
    USUAL_MATERIALS,
    Finish,
    Model,
    Part,
    SphereShape,
    Structure,
    StructureEntry,
)


def built(name, seed=0):
    model = OBJECTS[name].build(np.random.default_rng(seed))
    kind = OBJECTS[name].semantic_class
    return Structure("one", kind, model, (0.0, 0.0, 0.0)).materials


def test_every_class_has_a_material_and_every_material_a_range():
    assert USUAL_MATERIALS.keys() == CLASS_IDS.keys()
    assert set(USUAL_MATERIALS.values()) <= MATERIALS.keys()
    for one in MATERIALS.values():
        dark, bright = one.reflectivity
        assert 0.0 < dark <= bright
        # Only retro-reflectors are brighter than a white target.
        assert (bright > 1.0) == (one.kind == "retro")
        assert (one.leaf_area_density > 0.0) == (one.kind == "leaves")


def test_a_structure_without_materials_has_those_of_its_class():
    for name, usual in USUAL_MATERIALS.items():
        entry = StructureEntry(1, "a_glass", name)
        assert entry.material("glass") is MATERIALS[usual]


def test_objects_know_what_they_are_made_of():
    assert built("palm") == {"wood": "bark", "crown": "leaves"}
    assert set(built("hedge").values()) == {"hedge"}
    assert built("van") == {"body": "paint", "trim": "trim"}
    assert built("fountain") == {"stone": "boards", "water": "basin"}
    assert built("bus_shelter")["panes"] == "glass"
    assert built("round_planter") == {"pot": "pot", "leaves": "leaves"}
    assert built("sign_stop") == {"mast": "sheet", "plate": "stop_sign"}
    assert built("sign_triangular")["plate"] == "yield_sign"
    assert built("sign_direction")["plate"] == "way_sign"
    assert built("pedestrian_light")["signal"] == "signals"
    plates = {built("sign_round", seed)["plate"] for seed in range(20)}
    assert plates == {"stop_sign", "way_sign"}


@pytest.mark.parametrize("name", ["office", "row_house", "church"])
def test_windows_of_buildings_are_of_glass(name):
    kind = ARCHETYPES[name]
    side, height = sum(kind.widths) / 3, sum(kind.heights) / 2
    rng = np.random.default_rng(3)
    model = sample(name, box(0, 0, side, side), height, rng)
    building = Structure("one", "building", model, (0.0, 0.0, 0.0))
    panes = {p for p, m in building.materials.items() if m == "glass"}
    assert panes
    assert all("glass" in name for name in panes)
    assert set(building.materials.values()) <= {"glass", "plaster", "brick"}


def test_a_part_is_of_its_own_material_or_the_usual_one_of_the_class():
    parts = (
        Part("wall", SphereShape(1.0), rgb=(0.56, 0.33, 0.27)),
        Part("door", SphereShape(1.0), material="metal"),
    )
    model = Model(parts, {}, box(0, 0, 1, 1))
    for kind, usual in (("building", "plaster"), ("fence", "metal")):
        one = Structure("one", kind, model, (0.0, 0.0, 0.0))
        assert one.materials == {"wall": usual, "door": "metal"}


def test_walls_are_of_brick_where_the_palette_says_so():
    walls = dict(ARCHETYPES["corner_store"].colours["walls"])
    assert set(walls.values()) == {"brick", None}
    found = set()
    for seed in range(30):
        rng = np.random.default_rng(seed)
        model = sample("corner_store", box(0, 0, 14, 14), 9.0, rng)
        shop = Structure("one", "building", model, (0.0, 0.0, 0.0))
        for part in model.parts:
            if part.rgb in walls:
                known = walls[part.rgb] or "plaster"
                assert shop.materials[part.name] == known
                found.add(part.rgb)
            # Red signs and awnings are not of brick.
            elif "glass" not in part.name:
                assert shop.materials[part.name] == "plaster"
    assert found == walls.keys()


@pytest.mark.parametrize(
    ("value", "finish"),
    [
        ([0.5, 0.3, 1], Finish((0.5, 0.3, 1.0))),
        ({"brick": [0.5, 0.3, 0.2]}, Finish((0.5, 0.3, 0.2), "brick")),
        ({"glass": [0, 0, 0]}, Finish((0.0, 0.0, 0.0), "glass")),
    ],
)
def test_a_finish_of_a_file(value, finish):
    assert Finish.given(value) == finish


@pytest.mark.parametrize(
    "value",
    [[0.5, 0.3], "brick", {"brik": [0.5, 0.3, 0.2]}, {"brick": "red"}, {},
     {"brick": [0, 0, 0], "glass": [0, 0, 0]}],
)  # fmt: skip
def test_what_is_no_finish(value):
    with pytest.raises(ValueError, match=r"is no material|neither a colour"):
        Finish.given(value)
