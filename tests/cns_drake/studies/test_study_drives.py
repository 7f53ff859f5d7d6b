"""The drives that a study compares: what differs, and by which draws."""

import shutil

from helpers.small_map import write_town
import pytest
import yaml

from cns_drake.scenarios import load_scenario
from cns_drake.sensors import make_pattern
from cns_drake.studies import study_drives
from evaluation.base import Cluster, InputError
from evaluation.study import Study, load_experiment

# What a cause of the ladder may change, apart from the drive's name.
CHANGED = {
    "construction": ("database", {"stage"}),
    "raised": ("database", {"transient"}),
    **dict.fromkeys(
        ("parked_cars", "leaves", "snow", "scaffolds", "works", "furniture"),
        ("query", {"transient"}),
    ),
    "traffic": ("query", {"traffic"}),
    "weather": ("query", {"lidars", "weather", "seed"}),
    "returns": ("query", {"lidars", "seed"}),
    "ride": ("database", {"ride"}),
    "sensor": ("query", {"lidars"}),
    "hidden": ("query", set()),
    "turn": ("query", set()),
    "tilt": ("query", set()),
    "driver": ("database", {"driver", "traffic", "offset"}),
    "viewpoint": ("database", {"offset"}),
    "lateral": ("database", {"offset"}),
    "size": ("database", set()),
}


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """Folder of a map with three stages, and two drives of 60 frames."""
    routes = {"01": "metropolis_01", "04": "metropolis_04"}
    folder = write_town(tmp_path_factory.mktemp("maps") / "town", routes, 60)
    shutil.copy(folder / "stage_01.sdf", folder / "stage_02.sdf")
    return folder


@pytest.fixture
def drives(town, tmp_path):
    """Returns name -> drive of the study of an experiment's text or fields."""

    def find(text, source="mine.yaml", notes=None):
        path = tmp_path / "mine.yaml"
        path.write_text(text if isinstance(text, str) else yaml.safe_dump(text))
        return find_all(load_experiment(path), source, notes)

    def find_all(experiment, source="mine.yaml", notes=None):
        more = {} if notes is None else {"on_note": notes.append}
        run = Study(experiment, tmp_path / "out", source, Cluster(), **more)
        return {one.name: one for one in study_drives(run, [str(town)])}

    find.all = find_all
    return find


def differences(one, other):
    """The fields in which two scenarios differ."""
    return {
        name
        for name in type(one).model_fields
        if getattr(one, name) != getattr(other, name)
    }


@pytest.mark.parametrize("cause", CHANGED)
def test_a_cause_changes_one_drive_in_its_fields(drives, town, cause):
    ladder = load_experiment("ladder")
    found = drives.all(ladder.replaced(cases={cause: ladder.cases[cause]}))
    query = found.pop("town_04")
    assert query == load_scenario(town / "sequence_04.yaml")
    database = found.pop("town_04_database")
    assert differences(database, query) == {"name", "offset"}
    side, fields = CHANGED[cause]
    plain = {"database": database, "query": query}[side]
    assert bool(found) == bool(fields)
    for name, one in found.items():
        assert name.startswith(f"{plain.name}_{cause}_")
        assert differences(one, plain) - {"name"} <= fields
    if fields:
        changed = set.union(*(differences(x, plain) for x in found.values()))
        assert changed == fields | {"name"}
    contents = {
        one.replaced(name="").model_dump_json() for one in found.values()
    }
    assert len(contents) == len(found)


@pytest.mark.parametrize(
    ("fields", "draws"),
    [
        ({"query": {"transient": {"snow": 0.2}}}, True),
        ({"query": {"transient": {"snow": 0, "leaves": 1.0}}}, False),
        ({"query": {"transient": {}}}, False),
        ({"query": {"traffic": {"vehicles": 0}}}, False),
        ({"query": {"traffic": {"walkers": 1}}}, True),
        ({"database": {"ride": {"roughness": "A"}}}, True),
        ({"query": {"lidars": {"*": {"preset": "vlp-16"}}}}, False),
        ({"query": {"city": {"missing": 0, "towards": "01"}}}, False),
        ({"query": {"city": {"scattered": {"building": 1}}}}, True),
        ({"query": {"city": {"scattered": {"building": 1, "seed": 3}}}}, False),
        ({"query": {"lidars": {"*": {"returns": "calibrated"}}}}, True),
        ({"database": {"offset": {"left": 5}, "stage": "first"}}, False),
    ],
)
def test_seeds_change_what_is_random_alone(drives, fields, draws):
    found = drives({"maps": ["town"], "seeds": [1, 2, 3], **fields})
    (side,) = fields
    drawn = {
        one.replaced(name="").model_dump_json()
        for name, one in found.items()
        if ("database" in name) == (side == "database")
    }
    assert len(drawn) == (3 if draws else 1)


def test_names_tell_drives_apart(drives):
    """Equal drives share a name, others never do; long names are cut."""
    names = [f"tower_{k:03d}" for k in range(40)]
    found = drives(
        {
            "maps": ["town"],
            "database": {"offset": {"left": [0.5, 5, 2]}},
            "query": {
                "transient": {"snow": [0.2, 0, 0.1]},
                "lidars": {"*": {"preset": ["vlp-16", "os1-64"]}},
            },
            "baseline": {"query": {"transient": {"snow": 0}}},
            "seeds": [1, 2],
        }
    )
    # Without snow there is nothing to draw.
    assert len(found) == 3 + 2 * (1 + 2 * 2)
    found = drives(
        {
            "maps": ["town"],
            "database": {"without": [names[:2], names, names[:-1]]},
        }
    )
    assert "town_04_database_without__tower_000_tower_001__1" in found
    assert len(found) == 4
    assert all(len(name) < 80 for name in found)


@pytest.mark.parametrize("level", [1, 2, 3])
def test_lateral_offsets_are_5_m_a_level(drives, level):
    ladder = load_experiment("ladder")
    found = drives.all(
        ladder.replaced(cases={"lateral": ladder.cases["lateral"]})
    )
    drive = found[f"town_04_database_lateral_{level}_1"]
    assert drive.mounted_lidars["lidar"].xyz[:2] == (1.25, 5.0 * level)


@pytest.mark.parametrize(
    ("sessions", "number"),
    [
        ([{"offset": {"left": 0.5}}], 1),
        ([{"offset": {"left": 0.5}}, {"offset": {"left": 5}}], 2),
        # Equal drives are one.
        ([[{"offset": {"left": 0.5}}], [{"offset": {"left": 5}}]], 2),
    ],
)
def test_sessions_are_drives_of_the_database(drives, sessions, number):
    found = drives({"maps": ["town"], "database": {"sessions": sessions}})
    assert len([one for one in found if one != "town_04"]) == number


def test_data_sheets_as_a_factor(drives, tmp_path, monkeypatch):
    """Their paths start at the folder of the experiment."""
    sheet = "columns: 64\nranges: [0.5, 60.0]\nsource: mine\n"
    for name, rings in (("a", 48), ("b", 12)):
        text = f"rings_deg: [[10.0, -10.0, {rings}]]\n{sheet}"
        (tmp_path / f"{name}.yaml").write_text(text)
    (tmp_path / "work").mkdir()
    (tmp_path / "work" / "there").write_text(sheet)
    monkeypatch.chdir(tmp_path / "work")
    source = str(tmp_path / "mine.yaml")
    lidars = "{lidars: {lidar: {unit: [a.yaml, b.yaml]}}}"
    for query in (lidars, "{lidars: {'*': {unit: [a.yaml, b.yaml]}}}"):
        found = drives(f"maps: [town]\nquery: {query}\nseeds: 1\n", source)
        rings = {
            make_pattern(one.lidars["lidar"]).num_rings
            for name, one in found.items()
            if "database" not in name
        }
        assert rings == {48, 12}
    # A file of the working folder is not meant.
    with pytest.raises(InputError, match=rf"^{source}: query: .*there"):
        drives(
            f"maps: [town]\nquery: {lidars}\n".replace("a.yaml", "there"),
            source,
        )
    (tmp_path / "b.yaml").write_text("columns: 64\n")
    with pytest.raises(
        InputError, match=rf"^{source}: query: lidars.lidar.unit: .*b.yaml: "
    ):
        drives(f"maps: [town]\nquery: {lidars}\n", source)


FAULTS = [
    ("database: {foo: 1}", "database: foo: Extra"),
    ("query: {transient: {snoww: 1}}", "query: transient.snoww: .* snow?"),
    ("query: {transient: {snow: 2}}", "query: transient.snow: "),
    (
        "cases: {a: {protocol: {radius: [5, x]}}}",
        "cases.a.protocol: radius: Input should be a valid number",
    ),
    ("query: {transient: [{snow: 0}, 3]}", "query: transient: "),
    ("query: {lidars: {lidar: {colums: 9}}}", "query: lidars.lidar.colums: "),
    ("query: {traffic: 3}", "query: traffic: "),
    ("query: {driver: fast}", "query: driver: "),
    ("query: {traffic: {vehicles: x}}", "query: traffic.vehicles: "),
    ("database: {stage: '09'}", "database.stage: '09': town has 01, 02, 04"),
    ("database: {stage: 1}", "database.stage: 1: town has"),
    ("database: {stage: earlier 5}", "database.stage: 'earlier 5'"),
    ("cases: {a: {query: {stage: next}}}", "cases.a.query.stage: 'next'"),
    (
        "database: {stage: '01', city: {years: 5}}",
        ".*city.years: the last stage ages; give the drive stage: .04., not",
    ),
    (
        "database: {city: {redraw: 3, years: 5}}",
        "database: city.redraw: a city drawn anew does not age",
    ),
    ("query: {without: [nothing]}", "query.without: no structure 'nothing'"),
    ("both: {without: [nothing]}", "both.without: no structure 'nothing'"),
    ("query: {map: nowhere}", "query: map: 'nowhere' is neither"),
    ("query: {map: metropolis, stage: '09'}", "query.stage: '09': .* has 01"),
    (
        "database: {route: [{road: x, lane: 1, direction: forward}]}",
        r"database: route.0 \(x forward\): no road 'x'",
    ),
    ("query: {waypoints: no.csv}", "query: waypoints: no.csv: no such file"),
    ("query: {frames: 99999}", "query: frames: 99999 is too many: the drive"),
    (
        "cases: {a: {query: {traffic: {fcd: no.xml}}}}",
        "cases.a.query: traffic.fcd: no.xml: no such file",
    ),
    ("both: {transient: {snoww: 1}}", "both: transient.snoww: Extra"),
    ("cases: {a: {both: {sno: 1}}}", "cases.a.both: sno: Extra"),
    (
        "{cases: {a: {query: {ride: 3}}, b: [a]}, query: {imu: {rate: 20}}}",
        "cases.a.query: ride: ",
    ),
    ("query: {imu: {kalibr: no.yaml}}", "query: imu.kalibr: no.yaml: no such"),
    ("database: {city: {rates: 2}}", "database.city.rates: those of no years"),
    ("both: {city: {rates: 2}}", "both.city.rates: those of no years"),
    (
        "{database: {city: {rates: 2}}, query: {city: {years: 5}}}",
        "database.city.rates: those of no years",
    ),
    ("query: {distractors: 3}", "query.distractors: it is a field of database"),
    (
        "database: {city: {redraw: {frozen: 1}}}",
        "database.city.redraw: give a number",
    ),
    (
        "cases: {a: {both: {city: {redraw: {frozen: 1}}}}}",
        "cases.a.both.city.redraw: give a number",
    ),
    ("database: {distractors: -1}", "database.distractors: -1 is not from 0"),
    ("database: {distractors: 100001}", "database.distractors: 100001 is not"),
    ("database: {distractors: 1.5}", "database.distractors: 1.5 is not"),
    ("database: {distractors: true}", "database.distractors: True is not"),
    ("database: {offset: {left: 100.1}}", "database: offset.left: "),
    ("database: {offset: {left: far}}", "database: offset.left: "),
    ("database: {offset: {yaw_deg: 361}}", "database: offset.yaw_deg: "),
    ("database: {offset: 3}", "database: offset: "),
    ("query: {lidars: {'*': {preset: sonar}}}", "query: .*no preset 'sonar'"),
    ("query: {lidars: {'*': {returns: shiny}}}", "query: lidars.lidar.returns"),
    (
        "query: {weather: {visibility: 50}}",
        "query: .*weather.visibility: .* no effect",
    ),
    ("query: {weather: {fog: 1}}", "query: weather.fog: Extra"),
    ("protocol: {hide_sector: 360}", "protocol.hide_sector: 360 is not from 0"),
    ("protocol: {tilt_queries: -1}", "protocol.tilt_queries: -1 is not from 0"),
    ("protocol: {tilt_queries: steep}", "protocol: tilt_queries: "),
    ("protocol: {turn_queries: 1}", "protocol: turn_queries: "),
    ("database: {city: {missing: 1.1}}", "database: city.missing: "),
    ("database: {city: {missing: much}}", "database: city.missing: "),
    (
        "database: {city: {scattered: {palm: 0.5}}}",
        "database: city.scattered: no 'palm' in ",
    ),
    (
        "database: {city: {towards: '09'}}",
        "database: city.towards: map .* has no stage '09'",
    ),
    (
        "protocol: quick",
        "protocol.base: no protocol 'quick' .*random-yaw, paper",
    ),
    ("protocol: {radius: -1}", "protocol.radius: -1 is not positive"),
    ("protocol: {radius: true}", "protocol: radius: "),
    ("protocol: {radius: [5, far]}", "protocol: radius: "),
    ("protocol: {place: last}", "protocol: place: "),
    ("protocol: {place_spacing: 0}", "protocol.place_spacing: 0 is not"),
    ("protocol: {scans_per_place: 2.5}", "protocol: scans_per_place: "),
    ("protocol: {raduis: 3}", "protocol: raduis: Extra .* mean radius"),
    ("protocol: {verified: true}", "protocol: verified: Extra"),
    ("protocol: {overlap: 0.5}", "protocol: overlap: Extra"),
]


@pytest.mark.parametrize(("text", "fault"), FAULTS)
def test_faults_are_one_line_with_file_and_field(drives, text, fault):
    with pytest.raises(InputError, match=rf"^mine\.yaml: {fault}") as error:
        drives(text)
    assert "\n" not in str(error.value)


FLEET = {"cars": 2, "years": 3, "length": 100.0}
SESSION_FAULTS = [
    ({"fleet": {**FLEET, "cars": 0}}, r"database\.fleet: cars: "),
    ({"fleet": {**FLEET, "years": 201}}, r"database\.fleet: years: "),
    ({"fleet": {**FLEET, "length": 0}}, r"database\.fleet: length: "),
    ({"fleet": {**FLEET, "buses": 2}}, r"database\.fleet: buses: "),
    ({"fleet": 3}, r"database\.fleet: "),
    (
        {"fleet": FLEET, "sessions": [{}]},
        r"database\.fleet: give it or sessions",
    ),
    ({"sessions": []}, r"database\.sessions: a list without a value"),
    ({"sessions": [[]]}, r"database\.sessions: a list without a value"),
    ({"sessions": 2}, r"database\.sessions: not a list of one drive"),
    ({"sessions": {"old": {}}}, r"database\.sessions: not a list of one"),
    ({"sessions": [[{}, 3]]}, r"database\.sessions\.2: 3 is no mapping"),
    (
        {"sessions": [{"map": "riverside"}, {}]},
        r"database\.sessions\.1\.map: another map has another frame",
    ),
    (
        {"sessions": [{}, {"world": "x.sdf"}]},
        r"database\.sessions\.2\.world: another map has another frame",
    ),
    (
        {"sessions": [{"frames": 9}, {"frames": 9}]},
        r"database\.sessions\.2: the same drive as database\.sessions\.1",
    ),
    (
        {"sessions": [{}, {"aside": 1.0}, {"offset": {"left": 0.5}}]},
        r"database\.sessions\.3: the same drive as database\.sessions\.1",
    ),
    (
        {"sessions": [{"city": {"years": 2}}, {}]},
        r"database\.sessions\.1: this drive is later than the query",
    ),
    (
        {"fleet": FLEET},
        r"database\.fleet\.years: 3 years before a query .* aged by 0; give",
    ),
    (
        {"sessions": [{}, {"distractors": 5}]},
        r"database\.sessions\.2\.distractors: all drives share it",
    ),
    ({"sessions": [{"keep": 1}]}, r"database\.sessions\.1\.keep: all drives"),
    (
        {"sessions": [{"city": {"years": 201}}]},
        r"database\.sessions\.1: city\.years: ",
    ),
    (
        {"sessions": [{"city": {"years": True}}]},
        r"database\.sessions\.1: city\.years: ",
    ),
    ({"sessions": [{"snow": 1}]}, r"database\.sessions\.1: snow: "),
    ({"keep": 0}, r"database\.keep: 0 is neither all, latest nor a positive"),
    ({"keep": True}, r"database\.keep: True is neither"),
    ({"keep": "newest"}, r"database\.keep: 'newest' is neither"),
    (
        {"sessions": [{}, {"aside": 1.0}], "maintain": "magic"},
        r"database\.maintain: no maintainer 'magic' .*none, free-space",
    ),
    (
        {"sessions": [{"aside": 1.0}], "maintain": "truth"},
        r"database\.maintain: truth: no later drive updates the map of a",
    ),
    ({"maintain": "distance"}, r"database\.maintain: distance: no later"),
    ({"sessions": [{"maintain": "none"}, {}]}, r"1\.maintain: all drives"),
]


@pytest.mark.parametrize(("database", "fault"), SESSION_FAULTS)
def test_faults_of_sessions(drives, database, fault):
    with pytest.raises((InputError, ValueError), match=fault) as error:
        drives({"maps": ["town"], "database": database})
    assert "\n" not in str(error.value)
