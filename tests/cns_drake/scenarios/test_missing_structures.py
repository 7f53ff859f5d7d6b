"""What is missing from a city: the right structures, drawn independently."""

import csv
import itertools
from xml.etree import ElementTree

from helpers.small_map import box_visual, scenario_values, write_small_map
import pytest
import yaml

from cns_drake.scenarios import load_scenario, lost_structures
from cns_drake.scene import load_world, structures_in
from evaluation.base import InputError
from worlds.maps import shipped_maps

SOURCE = "mine.yaml"


def lost(drive="metropolis_01", seed=0, stage="04", **values):
    """Returns the names of what a drive through a stage loses."""
    scenario = load_scenario(drive).replaced(stage=stage)
    city = {"seed": seed, **values}
    return lost_structures(scenario.with_fields({"city": city}, SOURCE))


def places():
    table = shipped_maps()["metropolis"] / "structures.csv"
    with table.open() as file:
        return {
            row["name"]: (row["class"], float(row["x"]), float(row["y"]))
            for row in csv.DictReader(file)
        }


def test_parts_that_are_missing_grow_out_of_one_place():
    parts = (0, 0.2, 0.4, 0.6)
    gone = [lost(missing=part) for part in parts]
    everything = places()
    removable = [
        name
        for name, (kind, *_) in everything.items()
        # Objects on lots before building do not count.
        if kind in ("building", "vegetation") and "_lot_" not in name
    ]
    for part, names in zip(parts, gone, strict=True):
        assert len(names) == round(part * len(removable))
        assert set(names) <= set(removable)
    for less, more in itertools.pairwise(gone):
        assert set(less) < set(more)
    # The missing structures fill a circle without other structures.
    x0 = sum(everything[name][1] for name in gone[1]) / len(gone[1])
    y0 = sum(everything[name][2] for name in gone[1]) / len(gone[1])

    def distance(name):
        _, x, y = everything[name]
        return ((x - x0) ** 2 + (y - y0) ** 2) ** 0.5

    nearest = sorted(removable, key=distance)[: len(gone[1])]
    assert len(set(nearest) & set(gone[1])) > 0.6 * len(gone[1])


def test_between_two_stages_lies_what_the_earlier_one_lacks(tmp_path):
    town = write_small_map(tmp_path / "town")
    table = town / "structures.csv"
    head, *rows = table.read_text().splitlines()
    # Objects on lots before building are no part of the city.
    rows.append("42,tower_039_lot_1,vegetation")
    lot = box_visual("tower_039_lot_1/tree", (0, 0, 1, 0, 0, 0), (1, 1, 2))
    early = town / "stage_01.sdf"
    early.write_text(early.read_text().replace("</link>", f"{lot}</link>"))
    rows = [f"{row},{7 * k},{k % 5}" for k, row in enumerate(rows)]
    table.write_text("\n".join([f"{head},x,y", *rows, ""]))
    base = tmp_path / "base.yaml"
    base.write_text(yaml.safe_dump(scenario_values(town)))
    first, last = (
        {
            visual.get("name").partition("/")[0]
            for visual in ElementTree.parse(town / f"stage_{stage}.sdf").iter(
                "visual"
            )
        }
        for stage in ("01", "04")
    )
    first.remove("tower_039_lot_1")
    some = []
    for seed in (0, 1):
        gone = [
            set(lost(base, seed, towards="01", missing=part))
            for part in (0.0, 0.4, 1.0)
        ]
        assert gone[0] == set()
        assert gone[2] == last - first
        assert gone[1] < last - first
        assert len(gone[1]) == round(0.4 * len(last - first))
        some.append(gone[1])
    assert some[0] != some[1]
    # If all is missing, the structures are those of the target stage.
    scenario = load_scenario(base).replaced(stage="04")
    world = load_world(scenario.world_file, without=tuple(last - first))
    assert structures_in(world) == first


def test_structures_missing_here_and_there():
    parts = {"pole": 0.5, "building": 0.25}
    one, other = (set(lost(scattered=parts, seed=seed)) for seed in (0, 1))
    more = set(lost(scattered={"pole": 0.75}))
    kinds = {name: kind for name, (kind, *_) in places().items()}
    for kind, part in parts.items():
        names = {n for n in kinds if kinds[n] == kind and "_lot_" not in n}
        gone = [found & names for found in (one, other)]
        assert [len(g) for g in gone] == [round(part * len(names))] * 2
        assert gone[0] != gone[1]
    assert {kinds[name] for name in one} == set(parts)
    # A greater share of a class includes all that a smaller share lacks.
    poles = {name for name in one if kinds[name] == "pole"}
    assert poles < more
    # A seed of its own takes the place of the condition's.
    again = lost(scattered=parts | {"seed": 1}, seed=7)
    assert set(again) == other


@pytest.mark.parametrize(
    ("values", "fault"),
    [
        ({"missing": 1.2}, r"^mine.yaml: city.missing: Input should be less"),
        ({"missing": -0.1}, r"city.missing: Input should be greater"),
        ({"scattered": {"palm": 0.5}}, r"city\.scattered: no 'palm' in "),
        (
            {"scattered": {"pole": 1.5}},
            r"scattered: .*pole: 1\.5 is not from 0",
        ),
        ({"scattered": {"seed": -1}}, r"scattered: .*seed: -1\.0 is no whole"),
        ({"scattered": {"seed": 0.5}}, r"scattered: .*seed: 0\.5 is no whole"),
    ],
)
def test_faults_are_named(values, fault):
    with pytest.raises(InputError, match=fault) as error:
        lost(**values)
    assert "\n" not in str(error.value)
