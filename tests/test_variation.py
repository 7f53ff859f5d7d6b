"""Families: each member lacks what it should, and stands on its own."""

import csv
import itertools

import pytest
import yaml

from cns_drake.errors import InputError
from cns_drake.paths import shipped_maps
from cns_drake.planning import plan_drive
from cns_drake.scenario import load_scenario
from cns_drake.variation import load_family, write_scenarios
from cns_drake.world import load_world, structures_in


def family(tmp_path, **values):
    path = tmp_path / "family.yaml"
    path.write_text(yaml.safe_dump({"base": "metropolis_01"} | values))
    return load_family(path)


def places():
    table = shipped_maps()["metropolis"] / "structures.csv"
    with table.open() as file:
        return {
            row["name"]: (row["class"], float(row["x"]), float(row["y"]))
            for row in csv.DictReader(file)
        }


def test_parts_that_are_missing_grow_out_of_one_place(tmp_path):
    members = family(tmp_path, missing={"from": 0, "to": 0.6, "count": 4})
    everything = places()
    removable = [
        name
        for name, (kind, *_) in everything.items()
        if kind in ("building", "vegetation")
    ]
    assert [m.name.split("_")[2] for m in members] == [
        "m000",
        "m200",
        "m400",
        "m600",
    ]
    for part, member in zip((0, 0.2, 0.4, 0.6), members, strict=True):
        assert len(member.without) == round(part * len(removable))
        assert set(member.without) <= set(removable)
        assert member.stage == "04"
    for less, more in itertools.pairwise(members):
        assert set(less.without) < set(more.without)
    # What is missing fits into a circle that holds nothing else.
    gone = members[1].without
    x0 = sum(everything[name][1] for name in gone) / len(gone)
    y0 = sum(everything[name][2] for name in gone) / len(gone)

    def distance(name):
        _, x, y = everything[name]
        return ((x - x0) ** 2 + (y - y0) ** 2) ** 0.5

    nearest = sorted(removable, key=distance)[: len(gone)]
    assert len(set(nearest) & set(gone)) > 0.6 * len(gone)


def test_between_two_stages_lies_what_the_earlier_one_lacks(tmp_path):
    values = {"stage": "04", "towards": "02", "missing": [0.0, 0.4, 1.0]}
    members = family(tmp_path, seeds=[0, 1], **values)
    folder = shipped_maps()["metropolis"]
    first, last = (
        structures_in(load_world(folder / f"stage_{stage}.sdf"))
        for stage in ("02", "04")
    )
    gone = {m.name.split("_", 2)[2]: set(m.without) for m in members}
    assert gone["m000_s0"] == gone["m000_s1"] == set()
    assert gone["m1000_s0"] == gone["m1000_s1"] == last - first
    for name in ("m400_s0", "m400_s1"):
        assert gone[name] < last - first
        assert len(gone[name]) == round(0.4 * len(last - first))
    assert gone["m400_s0"] != gone["m400_s1"]
    assert members[2].title == "40.0 % of what stage 02 lacks missing"
    # All of it missing: the stage that it goes towards.
    (whole,) = [m for m in members if m.name.endswith("m1000_s0")]
    world = load_world(whole.world_file, without=whole.without)
    assert structures_in(world) == first


def test_seeds_choose_other_places(tmp_path):
    a, b, c = family(tmp_path, missing=[0.2], seeds=[0, 1, 0])
    assert a.without == c.without
    assert len(set(a.without) & set(b.without)) < 0.8 * len(a.without)


def test_routes_and_lidars_multiply(tmp_path):
    members = family(
        tmp_path,
        missing=[0.1, 0.2],
        routes={"count": 2, "length": 500},
        lidars=["cns", "os1-64"],
    )
    assert len(members) == len({member.name for member in members}) == 8
    assert {m.lidars["lidar"].preset for m in members} == {"cns", "os1-64"}
    routes = {str(m.route) for m in members}
    assert len(routes) == 2
    assert plan_drive(members[0]).length > 450.0


def test_a_member_is_a_scenario_file_of_its_own(tmp_path):
    members = family(tmp_path, missing=[0.3], lidars=["vlp-16"])
    paths = write_scenarios(members, tmp_path / "new" / "members")
    assert [load_scenario(path) for path in paths] == members


@pytest.mark.parametrize(
    ("values", "fault"),
    [
        ({"missing": [1.2]}, r"missing\.0: Input should be less"),
        ({"missing": {"from": 0, "to": 2, "count": 3}}, r"missing"),
        ({"missing": []}, r"missing"),
        ({"seed": [1]}, r"seed: Extra inputs"),
        ({"stage": "09"}, r"stage: map 'metropolis' has no stage '09'"),
        ({"towards": "07"}, r"stage: map 'metropolis' has no stage '07'"),
        ({"towards": "04"}, r"towards: stage 04 lacks nothing of stage 04"),
        ({"base": "nowhere"}, r"nowhere: no such scenario file"),
        ({"lidars": ["sonar"]}, r"unknown preset 'sonar'"),
    ],
)
def test_faults_are_named(tmp_path, values, fault):
    with pytest.raises(InputError, match=fault) as error:
        family(tmp_path, **values)
    assert "\n" not in str(error.value)


def test_a_city_needs_a_table_with_places(tmp_path):
    folder = tmp_path / "town"
    folder.mkdir()
    for name in ("roads.yaml", "stage_04.sdf"):
        (folder / name).symlink_to(shipped_maps()["metropolis"] / name)
    values = yaml.safe_load(
        (shipped_maps()["metropolis"] / "sequence_04.yaml").read_text()
    )
    (folder / "sequence_04.yaml").write_text(
        yaml.safe_dump(values | {"map": "."})
    )
    with pytest.raises(InputError, match=r"structures\.csv: No such file"):
        family(tmp_path, base="town/sequence_04.yaml")
    table = folder / "structures.csv"
    for text in (
        "name,class\nhut,building\n",
        "name,class,x,y\nhut,building,1,nan\n",
        "name,class,x,y\nhut,building,1,1e300\n",
    ):
        table.write_text(text)
        with pytest.raises(InputError, match=r"s\.csv: x, y: not the"):
            family(tmp_path, base="town/sequence_04.yaml")
