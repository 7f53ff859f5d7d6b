"""The two drives of each condition: what differs, and by which draws."""

from dataclasses import replace
from pathlib import Path
import shutil

from helpers.small_map import write_town
import numpy as np
import pytest
import shapely

from cns_drake.base import InputError
from cns_drake.roads import load_road_network
from cns_drake.scenarios import load_scenario, plan_drive
from cns_drake.sensors import make_pattern
from cns_drake.simulation import SimulationSource, plan_scenario_traffic
from cns_drake.studies import Experiment, load_experiment
from cns_drake.studies.drives.named_stages import MissingError
from cns_drake.studies.pairs.comparisons import PairMaker
from evaluation.recognition import RetrievalProtocol

RECORDED = RetrievalProtocol()
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
    "driver": ("database", {"driver", "traffic", "lidars"}),
    "viewpoint": ("database", {"lidars"}),
    "lateral": ("database", {"lidars"}),
    "size": ("database", set()),
}


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """Folder of a map with three stages, and two drives of 60 frames."""
    routes = {"01": "metropolis_01", "04": "metropolis_04"}
    folder = write_town(tmp_path_factory.mktemp("maps") / "town", routes, 60)
    shutil.copy(folder / "stage_01.sdf", folder / "stage_02.sdf")
    return folder


@pytest.fixture(scope="module")
def query_drive(town):
    return load_scenario(town / "sequence_04.yaml")


class Conditions:
    """The drives of all conditions of an experiment on one query drive."""

    def __init__(
        self,
        experiment,
        query,
        *,
        same_route=True,
        database=None,
        source="mine.yaml",
    ):
        self.notes = []
        self.made = []
        self.missing = []
        pair = PairMaker(
            database or query.replaced(name=f"{query.name}_database"),
            query,
            same_route,
            source,
            lambda drive, *given: self.make("aged", drive, given),
            lambda drive, *given: self.make("redrawn", drive, given),
            self.notes.append,
        )
        self.found = []
        for condition in experiment.conditions:
            for seed in experiment.seeds:
                try:
                    compared = pair.build(condition, seed)
                except MissingError as error:
                    self.missing.append(
                        (condition.factors["cause"], str(error))
                    )
                else:
                    self.found.append((condition.factors, seed, compared))

    def make(self, how, drive, given):
        self.made.append((how, drive.stage, *given))
        return f"/{how}/{'_'.join(map(str, given))}", "07"

    def by_cause(self):
        """Cause and level -> what is compared, for the last seed."""
        return {(f["cause"], f["level"]): c for f, _, c in self.found}

    def compared(self):
        return [compared for _, _, compared in self.found]


def experiment(**fields):
    return Experiment.model_validate({"name": "mine", **fields})


def ladder(*causes, levels=None, **more):
    """The ladder, or some of its causes."""
    found = load_experiment("ladder")
    if causes:
        cases = {n: c for n, c in found.cases.items() if n in causes}
        found = found.replaced(cases=cases)
    return found.replaced(levels=levels, **more)


def differences(one, other):
    """The fields in which two scenarios differ."""
    return {
        name
        for name in type(one).model_fields
        if getattr(one, name) != getattr(other, name)
    }


def poses_beside(compared):
    """X_QD (N, 4, 4): the LiDAR of the database seen from the query's."""
    query, database = (
        SimulationSource(one)().X_WS
        for one in (compared.query, compared.database)
    )
    return np.linalg.inv(query) @ database


def test_one_cause_changes_one_drive(query_drive):
    found = Conditions(ladder(), query_drive)
    rungs = found.by_cause()
    plain = rungs.pop(("none", 0))
    assert plain.query == query_drive
    assert differences(plain.database, query_drive) == {"name", "lidars"}
    assert plain.protocol == RECORDED
    assert (plain.distractors, plain.asked) == (0, {})
    for (cause, level), rung in rungs.items():
        changed = {
            side: differences(getattr(rung, side), getattr(plain, side))
            for side in ("database", "query")
        }
        if cause == "all":
            continue
        side, fields = CHANGED[cause]
        assert changed.pop(side) - {"name"} <= fields
        assert list(changed.values()) == [set()]
        assert bool(rung.asked) == (cause in ("hidden", "turn", "tilt"))
        sizes = (300, 1000, 3000, 10_000)
        assert rung.distractors == (sizes[level - 1] if cause == "size" else 0)
    assert {cause for cause, _ in rungs} == {*CHANGED, "all"}
    prints = [one.fingerprint() for one in rungs.values()]
    assert len(set(prints)) == len(prints)


def test_all_is_everything_at_its_level(query_drive):
    rungs = Conditions(ladder(levels=(4,)), query_drive).by_cause()
    strongest = {cause: rung for (cause, _), rung in rungs.items()}
    both = strongest.pop("all")
    assert both.distractors == 10_000
    asked = {"hide_sector": 120, "turn_queries": True, "tilt_queries": 3.0}
    assert both.asked == {**asked, "seed": 1}
    members = load_experiment("ladder").cases["all"]
    for cause in members:
        side, fields = CHANGED[cause]
        for field in fields - {"lidars", "seed"}:
            one, other = (
                getattr(getattr(rung, side), field)
                for rung in (both, strongest[cause])
            )
            if field == "transient":
                one, other = getattr(one, cause), getattr(other, cause)
            assert one == other, cause
    config = both.query.lidars["lidar"]
    assert (config.preset, config.returns) == ("mid-360", "calibrated")
    moved = both.database.lidars["lidar"]
    assert moved.rpy_deg[2] == 180.0
    # The lateral offset takes no part.
    assert moved.xyz[1] == 6.0
    assert both.protocol.radius == 7.5


def test_stages_of_a_map_with_few(query_drive, town):
    found = Conditions(ladder("construction"), query_drive)
    stages = {
        level: rung.database.stage
        for (_, level), rung in found.by_cause().items()
    }
    # The earliest of two stages is the strongest change.
    assert stages == {0: "04", 3: "02", 4: "01"}
    assert {text for _, text in found.missing} == {
        f"stages before 04: 2, so none for 'earlier {k}'" for k in (1, 2)
    }
    lonely = Conditions(
        ladder("construction", "snow"),
        load_scenario(town / "sequence_01.yaml"),
    )
    assert {cause for cause, _ in lonely.by_cause()} == {"none", "snow"}


def test_what_a_map_lacks_is_left_out_of_combined_cases(town):
    lonely = load_scenario(town / "sequence_01.yaml")
    many = ladder(levels=(4,))
    some = many.replaced(
        cases={
            **{n: many.cases[n] for n in ("construction", "snow", "sensor")},
            "both": ("construction", "snow"),
            "fields": {
                "database": {"stage": "earlier 4"},
                "query": {"transient": {"snow": 0.4}},
            },
        }
    )
    found = Conditions(some, lonely)
    assert found.missing == [("construction", "no stage before 01")]
    assert found.notes == ["no stage before 01"] * 2
    rungs = found.by_cause()
    snow = rungs["snow", 4]
    for one in (rungs["both", 4], rungs["fields", 1]):
        assert one.query.transient == snow.query.transient
        assert one.database.stage == "01"
        # Equal drives are one, however they came about.
        assert one.fingerprint() == snow.fingerprint()


def test_a_member_is_measured_at_a_lower_level(query_drive):
    """Of two earlier stages there is none for the first two levels."""
    cases = ladder().cases
    found = Conditions(
        ladder(levels=(1, 3)).replaced(
            cases={
                **{n: cases[n] for n in ("construction", "snow")},
                "all": ("construction", "snow"),
            }
        ),
        query_drive,
    ).by_cause()
    assert found["all", 1].database.stage == "04"
    assert found["all", 3].database.stage == "02"
    assert found["all", 3].query.transient.snow == 0.2


def test_traffic_on_a_map_without_any(town, tmp_path):
    folder = Path(shutil.copytree(town, tmp_path / "bare"))
    query_drive = load_scenario(folder / "sequence_04.yaml")
    (folder / "traffic.npz").unlink()
    found = Conditions(ladder("traffic"), query_drive)
    assert list(found.by_cause()) == [("none", 0), ("traffic", 4)]
    assert set(found.missing) == {("traffic", "no traffic.npz: no traffic")}


def test_seeds_are_those_of_what_is_drawn(query_drive):
    fields = {
        "both": {"seed": 9},
        "database": {
            "ride": {"roughness": ["none", "C"]},
            "driver": {"wander": 0.3},
        },
        "query": {
            "transient": {"snow": [0, 0.2]},
            "traffic": {"vehicles": 5, "seed": 77},
            "hide_sector": 90,
        },
    }
    found = Conditions(experiment(**fields, seeds=[3, 4]), query_drive)
    assert len(found.found) == 2 * 2 * 2
    for factors, seed, compared in found.found:
        database, query = compared.database, compared.query
        assert database.seed == query.seed == 9
        assert database.driver.seed == seed
        is_rough = factors["database.ride.roughness"] == "C"
        assert database.ride.seed == (seed if is_rough else 1)
        is_snowy = factors["query.transient.snow"] > 0
        assert query.transient.seed == (seed if is_snowy else 1)
        # A seed of one's own stays.
        assert query.traffic.seed == 77
        assert compared.asked == {"hide_sector": 90, "seed": seed}
        assert compared.protocol.seed == seed


def test_many_names_have_a_short_name(query_drive):
    names = [f"tower_{k:03d}" for k in range(40)]
    experiment = Experiment.model_validate(
        {
            "name": "mine",
            "maps": ["town"],
            "database": {"without": [names[:2], names, names[:-1]]},
        }
    )
    made = Conditions(experiment, query_drive)
    found = {one.database.name for one in made.compared()}
    assert len(found) == 3
    assert "town_04_database_without__tower_000_tower_001__1" in found
    assert all(len(name) < 80 for name in found)


@pytest.mark.parametrize(
    ("fields", "draws"),
    [
        ({"query": {"transient": {"snow": 0.2}}}, True),
        ({"query": {"transient": {"snow": 0, "leaves": 1.0}}}, False),
        ({"query": {"transient": {}}}, False),
        ({"query": {"traffic": {"vehicles": 0}}}, False),
        ({"query": {"traffic": {"walkers": 1}}}, True),
        ({"database": {"ride": {"roughness": "A"}}}, True),
        ({"database": {"driver": {"lane_changes": 0}}}, False),
        ({"query": {"tilt_queries": 2.0}}, True),
        ({"query": {"lidar": "vlp-16"}}, False),
        ({"query": {"returns": "calibrated"}}, True),
        ({"database": {"viewpoint": "lane", "stage": "first"}}, False),
        ({"database": {"years": 0}}, False),
        ({"database": {"years": 3}}, True),
        ({"database": {"redraw": 3}}, False),
        ({"database": {"distractors": 10}}, False),
    ],
)
def test_seeds_change_what_is_random_alone(query_drive, fields, draws):
    found = Conditions(experiment(**fields, seeds=[1, 2, 3]), query_drive)
    prints = {one.fingerprint() for one in found.compared()}
    assert len(prints) == (3 if draws else 1)


def test_names_tell_drives_apart(query_drive):
    """Equal drives share a name, others never do."""
    fields = {
        "database": {"viewpoint": ["near", "lane", [5.0, 0], [2, 0]]},
        "query": {
            "transient": {"snow": [0.2, 0, 0.1]},
            "lidar": ["vlp-16", "os1-64"],
        },
    }
    baseline = {"query": {"transient": {"snow": 0}}}
    found = Conditions(
        experiment(**fields, baseline=baseline, seeds=[1, 2]), query_drive
    )
    for side, number in (("database", 3), ("query", 2 * (1 + 2 * 2))):
        drives = {}
        for one in found.compared():
            drive = getattr(one, side)
            content = drive.replaced(name="").model_dump_json()
            drives.setdefault(content, set()).add(drive.name)
        assert all(len(names) == 1 for names in drives.values())
        assert len(set.union(*drives.values())) == len(drives) == number


def test_names_of_values_that_read_alike(query_drive):
    values = [-0.1, "m0.1", "m0p1", "m0p1 ", "m0p1_"]
    found = Conditions(experiment(query={"title": values[1:]}), query_drive)
    names = {one.query.name for one in found.compared()}
    assert len(names) == len(values) - 1


def test_queries_are_asked_as_a_condition_says(query_drive):
    common = replace(RECORDED, radius=5.0, query_spacing=20.0)
    found = Conditions(
        ladder(
            "hidden",
            "turn",
            "tilt",
            seeds=(3, 4),
            protocol={"base": "recorded", "radius": 5, "query_spacing": 20},
        ),
        query_drive,
    )
    asked = {
        (factors["cause"], factors["level"], seed): compared.protocol
        for factors, seed, compared in found.found
    }
    assert asked["none", 0, 3] == common
    assert asked["hidden", 2, 4] == replace(common, hide_sector=60.0, seed=4)
    assert asked["turn", 1, 3] == replace(common, turn_queries=True, seed=3)
    assert asked["tilt", 3, 3] == replace(common, tilt_queries=1.5, seed=3)


def test_drivers(query_drive):
    found = Conditions(ladder("driver", seeds=(5,)), query_drive)
    plain, *drivers = (one.database for one in found.compared())
    assert [one.driver.wander for one in drivers] == [0.35] * 4
    assert [bool(one.driver.lane_changes) for one in drivers] == [
        False,
        True,
        True,
        True,
    ]
    assert [one.traffic.vehicles for one in drivers] == [0, 0, 24, 24]
    assert {one.driver.seed for one in drivers} == {5}
    assert [one.lidars == plain.lidars for one in drivers] == [
        True,
        True,
        True,
        False,
    ]
    assert drivers[3].lidars["lidar"].xyz[:2] == (1.25, 5.0)
    assert drivers[3].lidars["lidar"].rpy_deg[2] == 180.0


@pytest.mark.slow
def test_drivers_by_name_stay_as_their_names_change(query_drive):
    """Two names would be two ways, and no condition asks for that."""
    wandering = query_drive.with_fields({"driver": {"wander": 0.3}}, "")
    found = Conditions(
        experiment(query={"transient": {"snow": [0, 0.2]}}), wandering
    )
    ways = [
        plan_drive(one.query).positions([4.0, 8.0]) for one in found.compared()
    ]
    np.testing.assert_array_equal(
        ways, [plan_drive(wandering).positions([4.0, 8.0])] * 2
    )


@pytest.mark.parametrize(
    ("viewpoint", "left", "heading_deg"),
    [
        ("near", 0.5, 0.0),
        ("lane", 5.0, 0.0),
        ("reversed", 5.0, 180.0),
        ([-2.0, 90.0], -2.0, 90.0),
    ],
)
def test_viewpoints_move_all_databases(
    query_drive, viewpoint, left, heading_deg
):
    found = Conditions(
        ladder("construction", "ride", database={"viewpoint": viewpoint}),
        query_drive,
    )
    places = {
        (config.xyz[:2], config.rpy_deg[2])
        for one in found.compared()
        for config in one.database.lidars.values()
    }
    assert places == {((1.25, left), heading_deg)}
    assert {one.query.lidars["lidar"].xyz for one in found.compared()} == {
        query_drive.lidars["lidar"].xyz
    }


def test_only_the_same_route_is_moved_aside(query_drive):
    """Two drives on routes of their own are as far apart as they are."""
    other = query_drive.replaced(name="other")
    found = Conditions(
        experiment(database={"viewpoint": ["near", [2, 0]]}),
        query_drive,
        same_route=False,
        database=other,
    )
    x, y, _ = query_drive.lidars["lidar"].xyz
    places = [one.database.lidars["lidar"].xyz[:2] for one in found.compared()]
    assert places == [(x, y + 0.5), (x, y + 2)]
    (plain,) = Conditions(
        experiment(), query_drive, same_route=False, database=other
    ).compared()
    assert plain.database == other


def test_the_other_carriageway(query_drive):
    rungs = Conditions(ladder("viewpoint", levels=(4,)), query_drive).by_cause()
    X_QD = poses_beside(rungs["viewpoint", 4])
    np.testing.assert_allclose(X_QD[:, :3, 3] - [[1.25, 6, 0]], 0, atol=1e-9)
    np.testing.assert_allclose(X_QD[:, 0, 0], -1.0, atol=1e-9)


def test_lateral_offsets_widen_the_radius(query_drive):
    """On a straight road, places match up to 7.5 m along it at any offset."""
    rungs = Conditions(ladder("lateral"), query_drive).by_cause()
    assert rungs.pop(("none", 0)).protocol.radius == 7.5
    for (_, level), rung in rungs.items():
        left = 5.0 * level
        assert rung.database.lidars["lidar"].xyz[:2] == (1.25, left)
        radius = rung.protocol.radius
        assert np.hypot(7.5 - 1e-6, left) < radius < np.hypot(7.5 + 1e-6, left)
    X_QD = poses_beside(rung)
    np.testing.assert_allclose(X_QD[:, :3, 3] - [[1.25, 15, 0]], 0, atol=1e-9)


@pytest.mark.slow
def test_queries_lie_at_the_same_places_in_every_condition(query_drive):
    rungs = Conditions(
        ladder("weather", "returns", "sensor", levels=(4,)), query_drive
    ).by_cause()
    expected = SimulationSource(rungs.pop(("none", 0)).query)().X_WS
    for rung in rungs.values():
        X_WS = SimulationSource(rung.query)().X_WS
        np.testing.assert_array_equal(X_WS, expected)


@pytest.mark.slow
def test_queues_stand_in_all_lanes_but_where_the_car_is(query_drive):
    rungs = Conditions(ladder("traffic", levels=(4,)), query_drive).by_cause()
    scenario = rungs["traffic", 4].query
    assert scenario.traffic.queues
    drive = plan_drive(scenario)
    plan = plan_scenario_traffic(scenario, drive)
    network = load_road_network(scenario.folder.roads)
    lines = shapely.MultiLineString(
        [
            network.roads[lane.road].lane_centreline(*lane[1:])[:, :2]
            for lane in network.lanes()
        ]
    )
    places = shapely.points(plan.vehicles.values[0, :, :2])
    assert shapely.distance(lines, places).max() < 0.5
    # A vehicle needs 7 m of a lane, some more.
    assert lines.length / 12 < len(places) < lines.length / 5
    gaps = []
    for t in np.linspace(0.0, drive.duration, 40):
        _, p_WB = drive.poses(np.array([t]))
        there = plan.vehicles.is_present(t)
        rows = plan.vehicles.values[0, there]
        gaps.append(np.hypot(*(rows[:, :2] - p_WB[:, :2]).T).min())
    # None stands in the car, and some close to it, in its lane or beside it.
    assert min(gaps) > 2.0
    assert np.median(gaps) < 12.0


def test_more_traffic_than_the_map_has(query_drive):
    """It is refused at once, not by a job."""
    with pytest.raises(InputError) as error:
        Conditions(
            experiment(query={"traffic": {"vehicles": [0, 61], "walkers": 3}}),
            query_drive,
        )
    assert "query: traffic: vehicles: 61 are too many" in str(error.value)


def test_maps_that_are_made(query_drive):
    """Sections of both sides and of cases come together."""
    found = Conditions(
        experiment(
            both={"rates": 2},
            cases={
                "old": {"database": {"years": [5, 20]}},
                "young": {"query": {"years": 5, "rates": 1}},
                "other": {"both": {"redraw": 7}},
            },
            seeds=[1, 2],
        ),
        query_drive,
    )
    assert found.made == [
        ("aged", "04", 5, 2, 1),
        ("aged", "04", 5, 2, 2),
        ("aged", "04", 20, 2, 1),
        ("aged", "04", 20, 2, 2),
        ("aged", "04", 5, 1, 1),
        ("aged", "04", 5, 1, 2),
        *[("redrawn", "04", 7)] * 4,
    ]
    rungs = found.by_cause()
    aged = rungs["old", 2]
    # The database is 20 years old: the query's city has lived on.
    assert (aged.query.map, aged.query.stage) == ("/aged/20_2_2", "07")
    assert aged.database.map == query_drive.map
    young = rungs["young", 1]
    assert young.database.map.startswith("/aged/5_1_")
    assert young.query == query_drive
    other = rungs["other", 1]
    assert other.database.map == other.query.map == "/redrawn/7"


def test_stages_by_their_place(query_drive, town):
    first = load_scenario(town / "sequence_01.yaml")
    wanted = ["own", "last", "first", "02", "earlier 3", "earlier 4"]
    found = Conditions(
        experiment(database={"stage": wanted}),
        query_drive,
        same_route=False,
        database=first,
    )
    stages = [one.database.stage for one in found.compared()]
    assert stages == ["01", "04", "01", "02", "02", "01"]


FAULTS = [
    ("database: {foo: 1}", "database: foo: Extra"),
    ("query: {transient: {snoww: 1}}", "query: transient.snoww: .* snow?"),
    ("query: {transient: {snow: 2}}", "query: transient.snow: "),
    ("query: {transient: [{snow: 0}, 3]}", "query: transient: "),
    ("query: {lidars: {lidar: {colums: 9}}}", "query: lidars.lidar.colums: "),
    ("query: {traffic: 3}", "query: traffic: "),
    ("query: {driver: fast}", "query: driver: "),
    ("query: {traffic: {vehicles: x}}", "query: traffic.vehicles: "),
    ("database: {stage: '09'}", "database.stage: '09': town has 01, 02, 04"),
    ("database: {stage: 1}", "database.stage: 1: town has"),
    ("database: {stage: earlier 5}", "database.stage: 'earlier 5'"),
    ("cases: {a: {query: {stage: next}}}", "cases.a.query.stage: 'next'"),
    ("{database: {stage: '01'}, query: {years: 5}}", "years: stage last ages"),
    (
        "{database: {redraw: 3}, query: {years: 5}}",
        "database.redraw: a city drawn anew does not age by query.years",
    ),
    ("query: {without: [nothing]}", "query.without: .*no structure nothing"),
    ("both: {without: [nothing]}", "both.without: .*no structure nothing"),
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
    ("database: {rates: 2}", "database.rates: those of no years"),
    ("both: {rates: 2}", "both.rates: those of no years"),
    (
        "{database: {rates: 2}, query: {years: 5}}",
        "database.rates: those of no years",
    ),
    ("query: {distractors: 3}", "query.distractors: it is a field of database"),
    ("both: {lateral: 3}", "both.lateral: it is a field of database"),
    ("database: {hide_sector: 3}", "database.hide_sector: .* field of query"),
    ("database: {redraw: {frozen: 1}}", "database.redraw: give a number"),
    (
        "cases: {a: {both: {redraw: {frozen: 1}}}}",
        "cases.a.both.redraw: give a number",
    ),
    ("database: {distractors: -1}", "database.distractors: -1 is not from 0"),
    ("database: {distractors: 100001}", "database.distractors: 100001 is not"),
    ("database: {distractors: 1.5}", "database.distractors: 1.5 is not"),
    ("database: {distractors: true}", "database.distractors: True is not"),
    ("database: {lateral: 100.1}", "database.lateral: 100.1 is not from 0"),
    ("database: {lateral: far}", "database.lateral: 'far' is not"),
    ("database: {lateral: 3, viewpoint: near}", "database.lateral: give it or"),
    ("database: {viewpoint: left}", "database.viewpoint: 'left' is neither"),
    ("database: {viewpoint: [1]}", r"database.viewpoint: \[1\] is neither"),
    ("database: {viewpoint: [101, 0]}", r"database.viewpoint: \[101, 0\] is"),
    ("database: {viewpoint: [0, 361]}", r"database.viewpoint: \[0, 361\] is"),
    ("query: {lidar: sonar}", "query.lidar: .*unknown preset 'sonar'"),
    ("query: {lidar: 3}", "query.lidar: "),
    ("query: {returns: shiny}", "query.returns: 'shiny' is neither ideal nor"),
    (
        "query: {weather: {visibility: 50}}",
        "query: .*weather.visibility: .* no effect",
    ),
    (
        "query: {returns: ideal, weather: {visibility: 50}}",
        "query.weather: no effect on ideal returns",
    ),
    (
        "query: {returns: calibrated, weather: {fog: 1}}",
        "query.weather: fog: Extra",
    ),
    ("query: {hide_sector: 360}", "query.hide_sector: 360 is not from 0"),
    ("query: {tilt_queries: -1}", "query.tilt_queries: -1 is not from 0"),
    ("query: {tilt_queries: steep}", "query: tilt_queries: "),
    ("query: {turn_queries: 1}", "query: turn_queries: "),
    ("database: {missing: 1.1}", "database: missing: "),
    ("database: {missing: much}", "database: missing: "),
    ("protocol: quick", "protocol.base: 'quick' is none of random-yaw, paper"),
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
def test_faults_are_one_line_with_file_and_field(
    query_drive, tmp_path, text, fault
):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=rf"^mine\.yaml: {fault}") as error:
        Conditions(load_experiment(path), query_drive)
    assert "\n" not in str(error.value)


def test_data_sheets_as_a_factor(query_drive, tmp_path):
    """Their paths start at the folder of the experiment."""
    sheet = "columns: 64\nranges: [0.5, 60.0]\nsource: mine\n"
    for name, rings in (("a", 48), ("b", 12)):
        text = f"rings_deg: [[10.0, -10.0, {rings}]]\n{sheet}"
        (tmp_path / f"{name}.yaml").write_text(text)
    path = tmp_path / "mine.yaml"
    lidars = "{lidars: {lidar: {unit: [a.yaml, b.yaml]}}}"
    path.write_text(f"query: {lidars}\nseeds: 1\n")
    found = Conditions(load_experiment(path), query_drive, source=str(path))
    by_value = {f["query.lidars.lidar.unit"]: c for f, _, c in found.found}
    for name, rings in (("a.yaml", 48), ("b.yaml", 12)):
        lidar = by_value[name].query.lidars["lidar"]
        assert make_pattern(lidar).num_rings == rings
        assert by_value[name].database.lidars["lidar"].preset == "cns"
    prints = {one.fingerprint() for one in by_value.values()}
    # Another sheet in the same file is another pair.
    (tmp_path / "a.yaml").write_text(f"rings_deg: [[9, -9, 48]]\n{sheet}")
    found = Conditions(load_experiment(path), query_drive, source=str(path))
    prints |= {one.fingerprint() for one in found.compared()}
    assert len(prints) == 3
    # The same for all LiDARs of a drive, beside presets.
    path.write_text("query: {lidar: [vlp-16, b.yaml]}\nseeds: 1\n")
    found = Conditions(load_experiment(path), query_drive, source=str(path))
    assert [
        make_pattern(one.query.lidars["lidar"]).num_rings
        for one in found.compared()
    ] == [16, 12]
    (tmp_path / "b.yaml").write_text("columns: 64\n")
    with pytest.raises(InputError, match=rf"^{path}: query.lidar: .*b.yaml: "):
        Conditions(load_experiment(path), query_drive, source=str(path))
    path.write_text(f"query: {lidars}\n")
    with pytest.raises(
        InputError, match=rf"^{path}: query: lidars.lidar.unit: .*b.yaml: "
    ):
        Conditions(load_experiment(path), query_drive, source=str(path))


def test_a_file_of_the_working_folder_is_no_sheet(
    tmp_path, query_drive, monkeypatch
):
    """Paths start at the experiment, also of files without an ending."""
    sheet = "rings_deg: [[9, -9, 5]]\ncolumns: 9\nranges: [1, 9]\nsource: a\n"
    (tmp_path / "here").write_text(sheet)
    (tmp_path / "work").mkdir()
    (tmp_path / "work" / "there").write_text(sheet)
    monkeypatch.chdir(tmp_path / "work")
    path = tmp_path / "mine.yaml"
    path.write_text("query: {lidar: here}\n")
    found = Conditions(load_experiment(path), query_drive, source=str(path))
    (compared,) = found.compared()
    assert make_pattern(compared.query.lidars["lidar"]).num_rings == 5
    path.write_text("query: {lidar: there}\n")
    with pytest.raises(
        InputError, match=rf"^{path}: query.lidar: unknown preset 'there'"
    ):
        Conditions(load_experiment(path), query_drive, source=str(path))
