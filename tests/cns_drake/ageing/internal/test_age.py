"""A small city that ages: nested, repeatable, sound; and its faults."""

import csv
import os
import re

from helpers.small_city import write_small_city
import numpy as np
import pytest
from scipy.stats import poisson
import shapely

from cns_drake.ageing import DEFAULT_RATES, age_map
from cns_drake.ageing.aged_map import AgeingCity, past_structures
from cns_drake.ageing.alterations import horizontal_section
from cns_drake.ageing.old_world import OldWorld
from cns_drake.ageing.standing_structures import structure_triangles
from cns_drake.base import InputError
from cns_drake.city import Structure, assemble, block, generate_city
from cns_drake.scenarios import load_scenario
from cns_drake.scene import MapFolder, load_world
from cns_drake.transient import geometry_by_structure

_DRIVE = """
map: .
stage: "02"
title: Around the north
route:
  - {road: north, direction: forward, lane: 1, start: 10.0, end: 120.0}
speeds: {cruise: 8.0}
"""
# A lot happens, so that a few years show all kinds of events.
_BUSY = {**dict.fromkeys(DEFAULT_RATES, 0.1), "built": 0.3, "moved": 2.0}


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    folder = write_small_city(tmp_path_factory.mktemp("age") / "town")
    generate_city(folder)
    (folder / "sequence_02.yaml").write_text(_DRIVE)
    return folder


@pytest.fixture(scope="module")
def world(town):
    return OldWorld(MapFolder(town))


@pytest.fixture(scope="module")
def long(town):
    output = town.parent / "long"
    age_map(town, [3, 8], 5, _BUSY, output)
    return output


def _rows(folder, name="history.csv"):
    with (folder / name).open() as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_histories_are_nested_and_repeatable(town, long):
    short = town.parent / "short"
    age_map(town, [3], 5, _BUSY, short)
    name = "stage_02.sdf"
    assert (short / name).read_bytes() == (long / name).read_bytes()
    few, many = _rows(short), _rows(long)
    assert few == [row for row in many if int(row["year"]) <= 3]
    assert len(few) < len(many)
    # Instance ids of the shorter history stay.
    ids = {r["name"]: r["instance"] for r in _rows(long, "structures.csv")}
    for row in _rows(short, "structures.csv"):
        assert ids[row["name"]] == row["instance"]


@pytest.mark.slow
@pytest.mark.night
def test_another_seed_is_another_history(town, long):
    other = town.parent / "other"
    age_map(town, [3], 6, _BUSY, other)
    assert _rows(other) != [r for r in _rows(long) if int(r["year"]) <= 3]


@pytest.mark.slow
def test_today_is_the_last_stage_of_the_map(town, long):
    today = (town / "stage_02.sdf").read_bytes()
    assert (long / "stage_01.sdf").read_bytes() == today


# What the rows of an event take from the list of structures, and add to it.
_TAKES = {"demolished", "felled", "removed", "furniture", "taken_down"}
_ADDS_ITSELF = {"built", "put_up"}
_ADDS_SUCCESSOR = {
    "replaced",
    "frame",
    "extended",
    "renewed",
    "planted",
    "furniture",
    "junction",
}


@pytest.mark.slow
def test_stages_follow_from_the_history(long):
    """The rows alone turn the list of one stage into that of the next."""

    def names(stage):
        text = (long / f"stage_{stage}.sdf").read_text()
        return set(re.findall('visual name="([^/"]+)/', text))

    rows = _rows(long)
    told = names("01")
    for stage, years in (("02", range(1, 4)), ("03", range(4, 9))):
        for row in rows:
            if int(row["year"]) not in years:
                continue
            one, successor = row["structure"], row["successor"]
            if row["event"] in _TAKES:
                told.remove(one)
            if row["event"] in _ADDS_ITSELF:
                told.add(one)
            if row["event"] in _ADDS_SUCCESSOR and successor:
                told.add(successor)
        assert told == names(stage)
    assert {"put_up", "taken_down", "frame", "replaced"} <= {
        row["event"] for row in rows
    }


@pytest.mark.slow
def test_drives_of_an_aged_map(long):
    drives = MapFolder(long).recordable_drives()
    assert [path.stem for path in drives] == [
        "sequence_01",
        "sequence_02",
        "sequence_03",
    ]
    assert load_scenario(drives[-1]).stage == "03"
    assert not load_world(long / "stage_03.sdf").notes


@pytest.mark.slow
def test_nothing_stands_in_another_or_on_a_street(long):
    things = geometry_by_structure(load_world(long / "stage_03.sdf"))
    new = [
        one
        for name, one in things.items()
        if re.search(r"\d{3}y", name)
        and not re.search("balconies|storey|site_|frame|scaffold|kerb", name)
    ]
    assert new
    walls = [t for t in things.values() if t.semantic_class == "building"]
    corners = np.concatenate(
        [
            part.p_WPs[part.geometry.surface.triangles]
            for part in things["carriageway"].parts
        ]
    )
    roads = shapely.union_all(shapely.polygons(corners[..., :2]))
    for one in new:
        inner = one.footprint.buffer(-0.3)
        assert not inner.intersects(roads), one.name
        for other in walls:
            if other.name in one.name or one.name in other.name:
                continue  # An annex stands against its own building.
            assert not inner.intersects(other.footprint.buffer(-0.3)), (
                one.name,
                other.name,
            )


@pytest.mark.slow
def test_new_things_stand_on_the_ground(long):
    world = OldWorld(MapFolder(long))
    checked = 0
    for name, thing in world.geometry.items():
        if not re.search(r"\d{3}y", name) or thing.footprint.is_empty:
            continue
        if re.search("balconies|storey|_frame|kerb|scaffold", name):
            continue
        at = np.array(thing.footprint.centroid.coords[0])
        z = world.ground.heights(at[None])[0]
        if np.isfinite(z):
            assert -1.6 < thing.bottom - z < 0.35, name
            checked += 1
    assert checked > 3


@pytest.mark.slow
def test_replacements_are_of_another_kind(long):
    events = [r for r in _rows(long) if r["event"] == "replaced"]
    for row in events:
        kinds = [
            re.sub(r"_\d.*", "", row[k]) for k in ("structure", "successor")
        ]
        assert kinds[0] != kinds[1]


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize("seed", [1, 2])
def test_rates_come_about(world, seed):
    """Numbers of 30 years are Poisson's, at one in a thousand for each."""
    city = AgeingCity(world, DEFAULT_RATES, seed, shapely.Polygon())
    for _ in range(30):
        city.live()
    tally = city.tally
    assert tally.expected["lamps"] > 5
    for event, rate in DEFAULT_RATES.items():
        if event == "moved":
            continue
        expected = rate * tally.exposure.get(event, 0)
        if event == "built":
            expected = tally.expected.get("built", 0.0)
        number = tally.number.get(event, 0)
        assert poisson.ppf(0.001, expected) <= number
        assert number <= poisson.ppf(0.999, expected)
    logged = [e.event for e in city.standing.events]
    assert logged.count("renewed") == tally.number["renewed"]
    assert logged.count("extended") == tally.number["extended"]


@pytest.mark.slow
def test_nothing_happens_at_rate_zero(world):
    city = AgeingCity(
        world,
        dict.fromkeys(DEFAULT_RATES, 0.0),
        1,
        shapely.Polygon(),
    )
    for _ in range(5):
        city.live()
    assert {e.event for e in city.standing.events} <= {"grown"}


@pytest.mark.slow
def test_what_is_painted_is_known_by_its_material(town, tmp_path):
    """Crossings of imported maps are markings; not every "mark" is one."""
    folder = copied(town, tmp_path / "town")
    for path in (*folder.glob("stage_*.sdf"), folder / "structures.csv"):
        text = path.read_text()
        for old, new in (
            ("markings", "crossing_n1"),
            ("carriageway", "market_street"),
        ):
            text = text.replace(f'name="{old}/', f'name="{new}/')
            text = text.replace(f",{old},road,", f",{new},road,")
        path.write_text(text)
    rates = {**dict.fromkeys(DEFAULT_RATES, 0.0), "markings": 1.0}
    city = AgeingCity(OldWorld(MapFolder(folder)), rates, 1, shapely.Polygon())
    city.live()
    painted = [
        e.structure for e in city.standing.events if e.event == "markings"
    ]
    assert painted == ["crossing_n1"]


def with_kinds(town, folder, kinds):
    copied(town, folder)
    rows = [{**row, "kind": ""} for row in _rows(town, "structures.csv")]
    for row in rows:
        row["kind"] = kinds.get(row["name"], "")
    with (folder / "structures.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, rows[0])
        table.writeheader()
        table.writerows(rows)
    return OldWorld(MapFolder(folder))


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("kind", "changes"),
    [
        ("", True),
        ("church", False),
        ("hill_chapel", False),
        ("churchill_offices", True),
        ("station", False),
        ("station_road_house", True),
    ],
)
def test_buildings_that_stay_are_known_by_their_kind(
    town, tmp_path, kind, changes
):
    name = "brick_block_001"
    world = with_kinds(town, tmp_path / "town", {name: kind})
    rates = {**dict.fromkeys(DEFAULT_RATES, 0.0), "renewed": 1.0}
    city = AgeingCity(world, rates, 1, shapely.Polygon())
    city.live()
    renewed = {
        e.structure for e in city.standing.events if e.event == "renewed"
    }
    assert (name in renewed) == changes
    assert "office_001" in renewed


@pytest.mark.night
@pytest.mark.slow
def test_trees_grow_about_their_feet_in_any_frame(town, world, tmp_path):
    """CityJSON has no frames of objects: S is the world's frame W."""
    copied(town, tmp_path / "town")
    rows = _rows(town, "structures.csv")
    trees = [row for row in rows if row["name"].startswith("tree_")]
    for row in trees:
        row |= {"x": "0.000", "y": "0.000", "z": "0.000", "yaw": "0.00000"}
    with (tmp_path / "town" / "structures.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, rows[0])
        table.writeheader()
        table.writerows(rows)
    found = []
    for one in (world, OldWorld(MapFolder(tmp_path / "town"))):
        city = AgeingCity(one, _BUSY, 2, shapely.Polygon())
        for _ in range(3):
            city.live()
        events = {e.event: e.structure for e in city.standing.events}
        assert {"grown", "planted"} <= events.keys()
        found.append(
            {
                name: structure_triangles(tree)
                for name, tree in city.standing.by_name.items()
                if tree is not None and tree.semantic_class == "vegetation"
            }
        )
    assert found[0].keys() == found[1].keys()
    assert len(found[0]) > 5
    for name, triangles in found[0].items():
        apart = np.abs(found[1][name] - triangles).max(axis=(0, 1))
        assert apart[:2].max() < 0.1
        # Generated trees grow from the ground, above their roots.
        assert apart[2] < 0.6


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("kind", "is_open"),
    [
        ("", True),
        ("park", False),
        ("village_green", False),
        ("water_body", False),
        ("parkland", True),
        ("engraved_stones", True),
    ],
)
def test_open_ground_is_known_by_its_kind(town, tmp_path, kind, is_open):
    name = "ground_north_block_paved"
    world = with_kinds(town, tmp_path / "town", {name: kind})
    block = world.area(lambda one: one.name == name)
    block = block.difference(world.streets).buffer(-0.2)
    assert block.area > 100.0
    shared = world.open_ground.intersection(block).area
    assert shared == pytest.approx(block.area if is_open else 0.0, abs=0.1)


@pytest.mark.parametrize(
    ("farthest", "least"), [(0.0, 0.0), (0.1, 0.1), (0.2, 0.2), (5.0, 0.2)]
)
def test_furniture_moves_as_far_as_allowed(world, farthest, least):
    rates = {
        **dict.fromkeys(DEFAULT_RATES, 0.0),
        "lamps": 1.0,
        "moved": farthest,
    }
    city = AgeingCity(world, rates, 1, shapely.Polygon())
    city.live()
    moves = [e for e in city.standing.events if e.event == "furniture"]
    assert moves
    by = []
    for one in moves:
        middles = (
            np.array(foot.centroid.coords[0])
            for foot in (
                world.geometry[one.structure].footprint,
                city.standing.new[one.successor].footprint_W,
            )
        )
        by.append(np.linalg.norm(np.subtract(*middles)))
    by = np.array(by)
    stays = by < 0.01  # No place was free, or none is allowed.
    assert stays.all() == (farthest == 0.0)
    assert (by[~stays] < farthest + 0.01).all()
    assert (by[~stays] > least - 0.01).all()


@pytest.mark.night
@pytest.mark.slow
def test_the_past_lacks_younger_buildings(town, tmp_path):
    folder = tmp_path / "dated"
    folder.mkdir()
    for path in town.iterdir():
        if path.is_file():
            (folder / path.name).write_bytes(path.read_bytes())
    (folder / "meshes").symlink_to(town / "meshes")
    rows = _rows(town, "structures.csv")
    houses = [r["name"] for r in rows if r["class"] == "building"]
    with (folder / "structures.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, [*rows[0], "built"])
        table.writeheader()
        for row in rows:
            built = ""
            if row["name"] in houses:
                built = 2020 if row["name"] == houses[0] else 1950
            table.writerow({**row, "built": built})
    world = OldWorld(MapFolder(folder))
    before, events = past_structures(world, -10)
    assert houses[0] not in before
    assert houses[1] in before
    assert not events[0].year
    after, _ = past_structures(world, 0)
    assert houses[0] in after
    age_map(folder, [-10, 0, 2], 1, _BUSY, tmp_path / "old")
    text = (tmp_path / "old" / "stage_02.sdf").read_text()
    assert f'"{houses[0]}/' not in text
    assert f'"{houses[1]}/' in text
    assert not (tmp_path / "old" / "stage_04.sdf").exists()


@pytest.mark.slow
def test_faulty_maps(town, tmp_path):
    def age(source, years=(1,), seed=1, output=None):
        age_map(source, years, seed, _BUSY, output or tmp_path / "new")

    with pytest.raises(InputError, match="no sequence_NN"):
        age(tmp_path)
    with pytest.raises(InputError, match="there already"):
        age(town, output=tmp_path)
    with pytest.raises(InputError, match="--seed"):
        age(town, seed=-1)
    with pytest.raises(InputError, match="column built"):
        age(town, years=(-5, 5))
    bare = tmp_path / "bare"
    bare.mkdir()
    for path in town.iterdir():
        if path.is_file():
            text = path.read_text().replace(",building,", ",other-structure,")
            (bare / path.name).write_text(text)
    (bare / "meshes").symlink_to(town / "meshes")
    with pytest.raises(InputError, match="without lots"):
        age(bare)
    assert not (tmp_path / "new").exists()


def names_in(folder, stage):
    text = (folder / f"stage_{stage}.sdf").read_text()
    return set(re.findall('visual name="([^/"]+)/', text))


@pytest.mark.slow
def test_each_stage_is_what_the_history_tells(long):
    """Scaffolds, uses of empty plots and annexes have rows as well."""
    standing = names_in(long, "01")
    rows = _rows(long)
    assert {"put_up", "taken_down", "demolished", "frame"} <= {
        row["event"] for row in rows
    }
    for stage, year in (("02", 3), ("03", 8)):
        while rows and int(rows[0]["year"]) <= year:
            row = rows.pop(0)
            one, successor = row["structure"], row["successor"]
            if row["event"] in (
                "demolished",
                "felled",
                "removed",
                "taken_down",
                "furniture",
            ):
                standing.remove(one)
            if row["event"] in ("built", "put_up"):
                assert one not in standing
                standing.add(one)
            if successor and row["event"] != "site":
                assert successor not in standing
                standing.add(successor)
        assert standing == names_in(long, stage)
    assert not rows


@pytest.mark.night
@pytest.mark.slow
def test_a_scaffold_stands_before_its_building(world):
    city = AgeingCity(world, _BUSY, 3, shapely.Polygon())
    standing = city.standing
    seen = 0
    for _ in range(8):
        city.live()
        for name in standing.by_name:
            if not name.startswith("scaffold_"):
                continue
            seen += 1
            own = standing.structure(name).footprint_W.buffer(-0.02)
            triangles = standing.triangles(name.removeprefix("scaffold_"))
            top = structure_triangles(standing.structure(name))[..., 2].max()
            for z in np.arange(triangles[..., 2].min() + 0.1, top - 1.2, 0.3):
                cut = horizontal_section(triangles, z)
                inside = shapely.intersection(shapely.linestrings(cut), own)
                assert not shapely.length(inside).any()
            assert standing.near(own, [name]) == []
    assert seen


@pytest.mark.slow
@pytest.mark.parametrize(("offset", "stands"), [(-0.03, False), (0.03, True)])
def test_a_scaffold_stands_in_nothing_however_thin(world, offset, stands):
    city = AgeingCity(world, _BUSY, 3, shapely.Polygon())
    standing, buildings = city.standing, city._buildings
    # The canopies of another building are not in the way of this one's.
    first, *_, other = (lot for lot in buildings.lots if lot.building)
    parts = []
    buildings._put_scaffold(first.plot, first.height, other.building, parts)
    (name,) = parts
    area = standing.structure(name).footprint_W
    standing.remove(name)
    # A railing 5 mm wide, all around its area: just inside, or outside.
    rail = area.buffer(offset).exterior.buffer(0.0025)
    model = assemble(block("steel", (0.1, 0.1, 1.0), (0, 0, 0), rgb=(1, 1, 1)))
    standing.put(Structure("railing", "fence", model, (0, 0, 0), 0.0), rail)
    parts.clear()
    buildings._put_scaffold(first.plot, first.height, other.building, parts)
    assert bool(parts) == stands


def copied(town, folder):
    folder.mkdir(parents=True)
    for path in town.iterdir():
        if path.is_file():
            (folder / path.name).write_bytes(path.read_bytes())
    (folder / "meshes").symlink_to(town / "meshes")
    return folder


@pytest.mark.parametrize(
    "uri",
    [
        "../../evil.obj",
        "meshes/../../evil.obj",
        "/tmp/evil.obj",
        "meshes/a/evil.obj",
        "&#46;&#46;/evil.obj",
        "<![CDATA[../evil.obj]]>",
        "model://evil.obj",
    ],
)
def test_a_map_of_others_writes_nothing_outside(town, tmp_path, uri):
    folder = copied(town, tmp_path / "pack" / "in" / "town")
    evil = tmp_path / "pack" / "evil.obj"
    evil.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    output = tmp_path / "mine" / "old"
    output.parent.mkdir()
    mine = output.parent / "evil.obj"
    mine.write_text("mine")
    stage = folder / "stage_02.sdf"
    text = re.sub(
        "<uri>meshes/[^<]*</uri>",
        lambda _: f"<uri>{uri}</uri>",
        stage.read_text(),
        count=1,
    )
    stage.write_text(text)
    with pytest.raises(InputError, match=r"stage_02\.sdf: uri: '.* is no file"):
        age_map(folder, [1], 1, _BUSY, output)
    assert mine.read_text() == "mine"
    assert [path.name for path in output.parent.iterdir()] == ["evil.obj"]


@pytest.mark.night
@pytest.mark.slow
def test_waypoints_of_any_names_are_kept_apart(town, tmp_path):
    folder = copied(town, tmp_path / "town")
    (folder / "stage_01.sdf").write_bytes((town / "stage_02.sdf").read_bytes())
    for number, x in (("01", 40.0), ("02", 60.0)):
        way = tmp_path / number / "structures.csv"
        way.parent.mkdir()
        way.write_text(f"x,y,z\n10,-48,0\n{x},-48,0\n")
        (folder / f"sequence_{number}.yaml").write_text(
            f'map: .\nstage: "{number}"\nwaypoints: ../{number}/{way.name}\n'
            "speeds: {cruise: 5.0}\n"
        )
    age_map(folder, [1], 1, _BUSY, tmp_path / "old")
    assert len(_rows(tmp_path / "old", "structures.csv")) > 9
    for number, x in (("01", "40"), ("02", "60")):
        scenario = load_scenario(tmp_path / "old" / f"sequence_{number}.yaml")
        assert scenario.waypoints.startswith(str(tmp_path / "old"))
        text = (tmp_path / "old" / scenario.waypoints).read_text()
        assert text.splitlines()[-1].startswith(x)


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("x", "nan"),
        ("y", ""),
        ("z", "abc"),
        ("yaw", "inf"),
        ("x", "1e300"),
        ("label", "9" * 5000),
        ("built", "9" * 5000),
        ("built", "1950.5"),
        ("instance", "1e2"),
    ],
)
def test_values_of_structures_that_cannot_be(town, tmp_path, column, value):
    folder = copied(town, tmp_path / "town")
    rows = [{"built": "", **row} for row in _rows(town, "structures.csv")]
    rows[3][column] = value
    with (folder / "structures.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, rows[0])
        table.writeheader()
        table.writerows(rows)
    with pytest.raises(
        InputError, match=rf"structures\.csv: line 5: {column}: '{value[:40]}'"
    ):
        age_map(folder, [1], 1, _BUSY, tmp_path / "old")


def test_tables_of_structures_that_are_none(town, tmp_path):
    folder = copied(town, tmp_path / "town")
    table = folder / "structures.csv"
    whole = table.read_text()
    table.write_bytes(whole.encode() + b"\xe9")
    with pytest.raises(InputError, match="not UTF-8"):
        OldWorld(MapFolder(folder))
    table.unlink()
    os.mkfifo(table)
    with pytest.raises(InputError, match="not a regular file"):
        OldWorld(MapFolder(folder))
    table.unlink()
    lines = whole.splitlines(keepends=True)
    name = lines[-1].split(",")[1]
    table.write_text("".join(lines[:-1]))
    with pytest.raises(InputError, match=f"no row for {name}"):
        OldWorld(MapFolder(folder)).structure(name)


def test_visuals_of_further_models_are_refused(town, tmp_path):
    """An aged stage would lack them: it has the visuals of one model."""
    folder = copied(town, tmp_path / "town")
    stage = folder / "stage_02.sdf"
    hut = (
        '<model name="inner"><static>true</static><link name="hut">'
        '<visual name="hut/wall">'
        "<geometry><box><size>1 1 1</size></box></geometry></visual></link>"
        "</model></model>"
    )
    text = stage.read_text()
    assert text.count("</model>") == 1
    stage.write_text(text.replace("</model>", hut))
    with pytest.raises(InputError, match=r"stage_02\.sdf: not one model"):
        OldWorld(MapFolder(folder))
