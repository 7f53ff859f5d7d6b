"""A small city that ages: nested, repeatable, sound; and its faults."""

import csv
import os
import re

import numpy as np
import pytest
import shapely

from cns_drake.scenarios import age_city, load_scenario
from cns_drake.scene import geometry_by_structure, load_world
from evaluation.base import InputError
from worlds.ageing import DEFAULT_RATES
from worlds.maps import MapFolder

# A lot happens, so that a few years show all kinds of events.
_BUSY = {**dict.fromkeys(DEFAULT_RATES, 0.1), "built": 0.3, "moved": 2.0}


@pytest.fixture(scope="module")
def long(town):
    output = town.parent / "long"
    age_city(town, [3, 8], 5, _BUSY, output)
    return output


def _rows(folder, name="history.csv"):
    with (folder / name).open() as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_histories_are_nested_and_repeatable(town, long):
    short = town.parent / "short"
    age_city(town, [3], 5, _BUSY, short)
    name = "stage_02.sdf"
    assert (short / name).read_bytes() == (long / name).read_bytes()
    few, many = _rows(short), _rows(long)
    assert few == [row for row in many if int(row["year"]) <= 3]
    assert len(few) < len(many)
    # The roads stay, and so does their traffic.
    for kept in ("roads.yaml", "traffic.npz"):
        assert (short / kept).read_bytes() == (town / kept).read_bytes()
    # Instance ids of the shorter history stay.
    ids = {r["name"]: r["instance"] for r in _rows(long, "structures.csv")}
    for row in _rows(short, "structures.csv"):
        assert ids[row["name"]] == row["instance"]


@pytest.mark.slow
@pytest.mark.night
def test_another_seed_is_another_history(town, long):
    other = town.parent / "other"
    age_city(town, [3], 6, _BUSY, other)
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
        [part.triangle_corners for part in things["carriageway"].parts]
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
def test_replacements_are_of_another_kind(long):
    events = [r for r in _rows(long) if r["event"] == "replaced"]
    for row in events:
        kinds = [
            re.sub(r"_\d.*", "", row[k]) for k in ("structure", "successor")
        ]
        assert kinds[0] != kinds[1]


@pytest.mark.slow
def test_faulty_maps(town, tmp_path):
    def age(source, years=(1,), seed=1, output=None):
        age_city(source, years, seed, _BUSY, output or tmp_path / "new")

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
            data = path.read_bytes()
            data = data.replace(b",building,", b",other-structure,")
            (bare / path.name).write_bytes(data)
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
        age_city(folder, [1], 1, _BUSY, output)
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
    age_city(folder, [1], 1, _BUSY, tmp_path / "old")
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
        age_city(folder, [1], 1, _BUSY, tmp_path / "old")


def test_tables_of_structures_that_are_none(town, tmp_path):
    folder = copied(town, tmp_path / "town")
    table = folder / "structures.csv"
    whole = table.read_text()
    table.write_bytes(whole.encode() + b"\xe9")
    with pytest.raises(InputError, match="not UTF-8"):
        age_city(folder, [1], 1, _BUSY, tmp_path / "old")
    table.unlink()
    os.mkfifo(table)
    with pytest.raises(InputError, match="not a regular file"):
        age_city(folder, [1], 1, _BUSY, tmp_path / "old")


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
        age_city(folder, [1], 1, _BUSY, tmp_path / "old")


@pytest.mark.parametrize(
    "years", [[], [2, 2], [5, 1], [1, 201], [-201, 0]], ids=str
)
def test_faulty_years(town, tmp_path, years):
    with pytest.raises(InputError, match="--years"):
        age_city(town, years, 1, _BUSY, tmp_path / "old")
