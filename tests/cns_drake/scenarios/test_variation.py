"""Families: each member lacks the right structures, independently."""

import csv
import itertools
import shutil
from xml.etree import ElementTree

from helpers.small_map import box_visual, scenario_values, write_small_map
import pytest
import yaml

from cns_drake.base.errors import InputError
from cns_drake.scenarios.planning import plan_drive
from cns_drake.scenarios.scenario_files import (
    load_scenario,
    map_folder,
    world_file,
)
from cns_drake.scenarios.shipped import shipped_maps
from cns_drake.scenarios.variation import load_family, write_scenarios
from cns_drake.scene.world import load_world, structures_in
from cns_drake.sensors.imu.config import KalibrImu


def family(tmp_path, redraw=None, **values):
    path = tmp_path / "family.yaml"
    path.write_text(yaml.safe_dump({"base": "metropolis_01"} | values))
    return load_family(path, redraw)


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
        # Objects on lots before building do not count.
        if kind in ("building", "vegetation") and "_lot_" not in name
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
    # The missing structures fill a circle without other structures.
    gone = members[1].without
    x0 = sum(everything[name][1] for name in gone) / len(gone)
    y0 = sum(everything[name][2] for name in gone) / len(gone)

    def distance(name):
        _, x, y = everything[name]
        return ((x - x0) ** 2 + (y - y0) ** 2) ** 0.5

    nearest = sorted(removable, key=distance)[: len(gone)]
    assert len(set(nearest) & set(gone)) > 0.6 * len(gone)


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
    values = {"stage": "04", "towards": "01", "missing": [0.0, 0.4, 1.0]}
    members = family(tmp_path, base=str(base), seeds=[0, 1], **values)
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
    gone = {tuple(m.name.split("_")[-2:]): set(m.without) for m in members}
    for seed in ("s0", "s1"):
        assert gone["m000", seed] == set()
        assert gone["m1000", seed] == last - first
        assert gone["m400", seed] < last - first
        assert len(gone["m400", seed]) == round(0.4 * len(last - first))
    assert gone["m400", "s0"] != gone["m400", "s1"]
    assert members[2].title == "40.0 % of what stage 01 lacks missing"
    # If all is missing, the structures are those of the target stage.
    (whole,) = [m for m in members if m.name.endswith("m1000_s0")]
    world = load_world(world_file(whole), without=whole.without)
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


def test_all_members_ride_and_measure_alike(tmp_path):
    ride = {"roughness": "C", "seed": 3}
    imu = {"xyz": [0.5, 0.0, 1.0]}
    values = {"missing": [0.1, 0.2], "ride": ride, "imu": imu}
    rough = family(tmp_path, **values)
    rigid = family(tmp_path, missing=[0.1, 0.2])
    assert [m.name for m in rough] == [m.name for m in rigid]
    for member, other in zip(rough, rigid, strict=True):
        assert member.ride.model_dump() == ride
        assert member.imu.xyz == (0.5, 0.0, 1.0)
        update = {"ride": other.ride, "imu": other.imu}
        assert member.model_copy(update=update) == other
    (path, _) = write_scenarios(rough, tmp_path / "written")
    assert load_scenario(path) == rough[0]


def test_noise_of_an_imu_lies_beside_the_family(tmp_path):
    imu = {"rate": 200, "kalibr": "noise.yaml"}
    with pytest.raises(InputError, match=r"noise\.yaml: no such file"):
        family(tmp_path, missing=[0.1], imu=imu)
    noise = dict.fromkeys(KalibrImu.model_fields, 0.01)
    noise |= {"update_rate": 200.0, "rostopic": "/imu"}
    (tmp_path / "noise.yaml").write_text(yaml.safe_dump(noise))
    (member,) = family(tmp_path, missing=[0.1], imu=imu)
    assert member.imu.kalibr == str(tmp_path / "noise.yaml")


def test_a_member_is_a_scenario_file_of_its_own(tmp_path):
    members = family(tmp_path, missing=[0.3], lidars=["vlp-16"])
    paths = write_scenarios(members, tmp_path / "new" / "members")
    assert [load_scenario(path) for path in paths] == members


@pytest.mark.slow
@pytest.mark.parametrize(
    ("values", "fault"),
    [
        ({"missing": [1.2]}, r"missing\.0: Input should be less"),
        ({"missing": {"from": 0, "to": 2, "count": 3}}, r"missing"),
        ({"missing": []}, r"missing"),
        ({"seed": [1]}, r"seed: Extra inputs"),
        ({"stage": "09"}, r"stage: map 'metropolis' has no stage '09'"),
        ({"towards": "07"}, r"stage: map 'metropolis' has no stage '07'"),
        ({"base": "nowhere"}, r"nowhere: no such scenario file"),
        ({"lidars": ["sonar"]}, r"unknown preset 'sonar'"),
        ({"city_seeds": []}, r"city_seeds: "),
        ({"city_seeds": [1, -1]}, r"city_seeds\.1: "),
        ({"city_seeds": [1.5]}, r"city_seeds\.0: "),
        ({"city_seeds": [4, 1, 4]}, r"city_seeds: the seed 4 is there twice"),
        (
            {"city_seeds": [1], "stage": "04", "towards": "02"},
            r"family\.yaml: towards: not with city_seeds: stages ",
        ),
        (
            {"city_seeds": [1], "stage": "02"},
            r"family\.yaml: stage: not with city_seeds: .* one, 04, are",
        ),
        ({"city_seeds": [1], "lidars": ["sonar"]}, r"unknown preset 'sonar'"),
    ],
)
def test_faults_are_named(tmp_path, values, fault):
    with pytest.raises(InputError, match=fault) as error:
        # Errors are found before any long work.
        family(tmp_path, redraw=lambda *_: pytest.fail("drawn"), **values)
    assert "\n" not in str(error.value)


def test_a_stage_that_lacks_nothing_is_no_aim(small_map, tmp_path):
    base = tmp_path / "base.yaml"
    base.write_text(yaml.safe_dump(scenario_values(small_map)))
    with pytest.raises(
        InputError, match="towards: stage 04 lacks nothing of stage 04"
    ):
        family(tmp_path, base=str(base), towards="04")


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
        with pytest.raises(InputError, match=r"s\.csv: x, y: every structure"):
            family(tmp_path, base="town/sequence_04.yaml")


@pytest.fixture
def town(tmp_path):
    """Folder of a map with a drive."""
    folder = write_small_map(tmp_path / "town")
    (folder / "city.yaml").touch()
    (folder / "sequence_01.yaml").write_text(
        yaml.safe_dump(scenario_values(".") | {"name": "town_01"})
    )
    return folder


class Redrawing:
    """Draws cities with a row of trees, ten times the seed of them."""

    def __init__(self, town, output):
        self.town = town
        self.output = output
        self.calls = []

    def __call__(self, map_folder, stage, seeds):
        self.calls.append((map_folder, stage, tuple(seeds)))
        folders = {seed: self.output / f"town_c{seed}" for seed in seeds}
        for seed, folder in folders.items():
            folder.mkdir(parents=True)
            for name in ("roads.yaml", f"stage_{stage}.sdf"):
                shutil.copy(self.town / name, folder)
            table = ["name,class,x,y"]
            table += [f"tree_{k},vegetation,{k},0" for k in range(10 * seed)]
            (folder / "structures.csv").write_text("\n".join(table) + "\n")
        return folders


def test_other_cities_multiply_a_family_and_decay_on_their_own(tmp_path, town):
    redraw = Redrawing(town, tmp_path / "out" / "cities")
    members = family(
        tmp_path,
        redraw=redraw,
        base="town/sequence_01.yaml",
        city_seeds=[5, 2],
        missing=[0.0, 0.5],
        seeds=[0, 1],
        lidars=["cns", "os1-64"],
    )
    assert redraw.calls == [(town, "04", (5, 2))]
    assert len(members) == len({m.name for m in members}) == 16
    by_name = {m.name: m for m in members}
    for city_seed, part, seed in itertools.product((5, 2), (0, 500), (0, 1)):
        stem = f"town_01_c{city_seed}_m{part:03d}_s{seed}"
        cns, ouster = by_name[f"{stem}_cns"], by_name[f"{stem}_os1_64"]
        assert ouster.lidars["lidar"].preset == "os1-64"
        for member in (cns, ouster):
            assert member.map == str(redraw.output / f"town_c{city_seed}")
            assert member.stage == "04"
            assert f"seed {city_seed}" in member.title
        gone = sorted(int(name[5:]) for name in cns.without)
        assert len(gone) == 10 * city_seed * part // 1000
        # The structures of a row nearest to a place are neighbours.
        assert all(b == a + 1 for a, b in itertools.pairwise(gone))


def test_without_other_cities_none_is_drawn(tmp_path, town):
    members = family(tmp_path, redraw=lambda *_: pytest.fail("drawn"))
    assert [m.map for m in members] == ["metropolis"]


def test_a_folder_of_cities_and_scenarios_can_be_moved(tmp_path, town):
    output = tmp_path / "out"
    members = family(
        tmp_path,
        redraw=Redrawing(town, output / "cities"),
        base="town/sequence_01.yaml",
        city_seeds=[2],
        missing=[0.2],
    )
    (path,) = write_scenarios(members, output / "scenarios")
    assert load_scenario(path) == members[0]
    assert yaml.safe_load(path.read_text())["map"] == "../cities/town_c2"
    moved = tmp_path / "far" / "away"
    moved.parent.mkdir()
    output.rename(moved)
    member = load_scenario(moved / path.relative_to(output))
    assert map_folder(member).path == moved / "cities" / "town_c2"
    assert member.without == members[0].without
    # A map that lies elsewhere stays where it is.
    (path,) = write_scenarios(
        family(tmp_path, base="metropolis_02"), moved / "scenarios"
    )
    assert yaml.safe_load(path.read_text())["map"] == "metropolis"
    values = yaml.safe_load((town / "sequence_01.yaml").read_text())
    elsewhere = load_scenario(town / "sequence_01.yaml")
    assert values["map"] == "."
    (path,) = write_scenarios([elsewhere], moved / "scenarios")
    assert yaml.safe_load(path.read_text())["map"] == str(town)


@pytest.mark.parametrize("missing", ["city.yaml", "roads.yaml"])
def test_a_map_without_a_plan_has_no_other_city(tmp_path, town, missing):
    (town / missing).unlink()
    with pytest.raises(
        InputError,
        match=rf"family\.yaml: city_seeds: no .*{missing}, .* base town_01 ",
    ) as error:
        family(
            tmp_path,
            redraw=lambda *_: pytest.fail("drawn"),
            base="town/sequence_01.yaml",
            city_seeds=[1],
        )
    assert "\n" not in str(error.value)


def test_structures_missing_here_and_there(tmp_path):
    parts = {"pole": 0.5, "building": 0.25}
    one, other = family(tmp_path, scattered=parts, seeds=[0, 1])
    (more,) = family(tmp_path, scattered={"pole": 0.75}, seeds=[0])
    kinds = {name: kind for name, (kind, *_) in places().items()}
    for kind, part in parts.items():
        names = {n for n in kinds if kinds[n] == kind and "_lot_" not in n}
        gone = [set(m.without) & names for m in (one, other)]
        assert [len(g) for g in gone] == [round(part * len(names))] * 2
        assert gone[0] != gone[1]
    assert {kinds[name] for name in one.without} == set(parts)
    # A greater share of a class includes all that a smaller share lacks.
    poles = {name for name in one.without if kinds[name] == "pole"}
    assert poles < set(more.without)


def test_a_class_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="scattered: no 'palm'"):
        family(tmp_path, scattered={"palm": 0.5})


@pytest.mark.parametrize("name", ["hard", "hard2"])
def test_shipped_families_with_losses(name):
    folder = shipped_maps()["downtown"]
    (database,) = load_family(folder / f"{name}_database.yaml")
    (query,) = load_family(folder / f"{name}_query.yaml")
    assert (database.stage, query.stage) == ("04", "04")
    assert set(database.without) - set(query.without)
    assert set(query.without) - set(database.without)
