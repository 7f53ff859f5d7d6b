"""Several drives in a database: which they are, their order, and their rows."""

from helpers.internal import studies
from helpers.small_map import write_town
import pytest

from cns_drake.base import Cluster, InputError
from cns_drake.scenarios import load_scenario
from cns_drake.studies import (
    Experiment,
    ExperimentRun,
    load_experiment,
    run_study,
)
from cns_drake.studies import study as study_module
from cns_drake.studies.pairs.comparisons import PairMaker
from cns_drake.studies.study import plan_study
from evaluation.methods.solid import SolidMethod
from evaluation.results import Results
from evaluation.study import OPENING_COST, USUAL_LENGTH, engine


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """Folder of a map with two drives of 40 frames along one route."""
    routes = {"01": "metropolis_04", "04": "metropolis_04"}
    return write_town(tmp_path_factory.mktemp("maps") / "town", routes, 40)


def experiment(**fields):
    return Experiment.model_validate({"name": "mine", **fields})


def aged(drive, years, rates, seed):
    return f"/aged_{rates}", f"{years:02d}"


def not_yet(drive, *given):
    return str(drive.map), str(drive.stage)


def redrawn(drive, seed):
    return "/redrawn", str(seed)


def compared(town, age=aged, redraw=redrawn, **fields):
    """What is compared in each condition, aged cities being only named."""
    query = load_scenario(town / "sequence_04.yaml")

    pair = PairMaker(
        query.replaced(name=f"{query.name}_database"),
        query,
        True,
        "mine.yaml",
        age,
        redraw,
        lambda text: None,
    )
    wanted = experiment(**fields)
    return [pair.build(one, 1) for one in wanted.conditions]


@pytest.mark.parametrize(
    "fields",
    [
        {"years": 10},
        {"viewpoint": "lane", "transient": {"snow": 0.3}},
        {"lidar": "os1-64", "years": 3, "rates": 2.0},
        {},
    ],
)
def test_one_session_is_the_database_itself(town, fields):
    shared = {n: fields[n] for n in ("rates",) if n in fields}
    own = {n: one for n, one in fields.items() if n not in shared}
    (plain,) = compared(town, database=fields)
    (one,) = compared(town, database={**shared, "sessions": [own]})
    assert one == plain
    assert one.fingerprint() == plain.fingerprint()


def test_fields_of_the_database_are_those_of_each_session(town):
    (found,) = compared(
        town,
        database={
            "transient": {"snow": 0.5},
            "sessions": [{"transient": {"leaves": 0.0}}, {"viewpoint": "lane"}],
        },
    )
    seasons = [(o.transient.snow, o.transient.leaves) for o in found.drives]
    assert seasons == [(0.5, 0.0), (0.5, 1.0), (0.0, 1.0)]


def test_each_session_sees_the_city_of_its_year(town):
    """Of 20 years, 15 have passed at the second drive, 20 at the query."""
    (found,) = compared(
        town,
        database={"sessions": [{"years": 5}, {"years": 20}, {"years": 0}]},
    )
    places = [(one.map, one.stage) for one in found.drives]
    ages = [("/aged_1.0", "15"), *[("/aged_1.0", "20")] * 2]
    # Sessions are sorted from older to newer.
    assert places == [(found.database.map, "04"), *ages]
    assert "aged" not in found.database.map


def test_the_years_of_the_database_fix_the_city_of_the_query(town):
    new, old = compared(
        town,
        database={"years": 20, "sessions": [[{"years": 1}], [{"years": 15}]]},
    )
    assert [one.stage for one in new.drives] == ["19", "20"]
    assert [one.stage for one in old.drives] == ["05", "20"]
    assert new.query == old.query


def test_years_of_the_query_move_all_drives(town):
    """The query is 2 years old, so the oldest of 10 years is 8 before it."""
    (found,) = compared(
        town,
        database={"sessions": [{"years": 10}, {"years": 2}]},
        query={"years": 2},
    )
    assert [one.stage for one in found.drives] == ["02", "10", "10"]


def test_older_stages_come_first(town):
    (found,) = compared(
        town,
        database={"sessions": [{"stage": "04"}, {"stage": "01"}]},
    )
    assert [one.stage for one in found.drives] == ["01", "04", "04"]


def test_sessions_keep_and_their_fields_are_factors(town):
    wanted = experiment(
        database={
            "sessions": [{"years": [5, 10]}, {"years": 0}],
            "keep": ["all", 1],
        }
    )
    assert [one.factors for one in wanted.conditions] == [
        {"database.sessions.1.years": years, "database.keep": keep}
        for years in (5, 10)
        for keep in ("all", 1)
    ]
    sets = [[{"years": 5}], [{"years": 5}, {"years": 0}]]
    wanted = experiment(database={"sessions": sets})
    assert [one.factors for one in wanted.conditions] == [
        {"database.sessions": text}
        for text in ("[{years: 5}]", "[{years: 5},{years: 0}]")
    ]


def test_conditions_share_the_drives_that_are_the_same(town):
    found = compared(
        town,
        database={
            "sessions": [
                [{"viewpoint": "near"}],
                [{"viewpoint": "near"}, {"viewpoint": "lane"}],
                [{"viewpoint": "lane"}],
            ]
        },
    )
    near, both, lane = found
    assert both.drives[:2] == (near.database, lane.database)
    assert len({one.fingerprint() for one in found}) == 3


def test_drives_have_the_lengths_of_their_routes(town):
    drawn = {"route": {"length": 350.0, "seed": 1}}
    (found,) = compared(
        town,
        database={"sessions": [{}, {"viewpoint": "lane", **drawn}]},
        query={"route": {"length": 70.0, "seed": 2}},
    )
    assert found.lengths == (USUAL_LENGTH, 350.0, 70.0)
    assert found.ages == ()


def test_costs_grow_with_what_is_measured(town, tmp_path):
    """A route of half the length has half the scans, and as many jobs."""
    costs = []
    for length in (100.0, 200.0):
        wanted = experiment(
            maps=[str(town)],
            both={"route": {"length": length, "seed": 1}},
            database={"sessions": [{}, {"viewpoint": "lane"}]},
            tasks=["place", "localise"],
            **SIMULATED,
        )
        jobs = plan_study(run_of(wanted, tmp_path))[0].jobs
        found: dict[str, float] = {}
        for name, job in jobs.items():
            kind = name.partition(" ")[0]
            found[kind] = found.get(kind, 0.0) + job.cost
        costs.append(found)
    short, long = costs
    assert short.keys() == long.keys()
    # Three drives are opened. The two of a map are opened twice, once for their
    # poses.
    opened = {"describe": 3 * OPENING_COST, "localise": 5 * OPENING_COST}
    for kind, start in opened.items():
        assert long[kind] - start == pytest.approx(2.0 * (short[kind] - start))
    assert long["place"] > 2.0 * short["place"] - 2.0
    assert short["cost"] < long["cost"] < 2.0 * short["cost"]


def test_a_slow_method_costs_more(town, tmp_path, monkeypatch):
    wanted = experiment(
        maps=[str(town)],
        both={"route": {"length": 200.0, "seed": 1}},
        **SIMULATED,
    )

    def cost():
        jobs = plan_study(run_of(wanted, tmp_path))[0].jobs
        return sum(job.cost for job in jobs.values())

    usual = cost()
    slower = SolidMethod.describe_time + 3.0
    monkeypatch.setattr(SolidMethod, "describe_time", slower)
    scans = 200.0 / 2.0 + 200.0 / 5.0
    assert cost() - usual == pytest.approx(3.0 * scans)
    # So does one that searches slowly: each query, and each pair.
    monkeypatch.undo()
    monkeypatch.setattr(SolidMethod, "query_time", SolidMethod.query_time + 2.0)
    queries, places = sorted((200.0 / 2.0, 200.0 / 5.0))
    assert cost() - usual == pytest.approx(2.0 * queries)
    monkeypatch.setattr(SolidMethod, "place_time", SolidMethod.place_time + 0.1)
    slow = (2.0 + 0.1 * places) * queries
    assert cost() - usual == pytest.approx(slow)


def run_of(wanted, output):
    return ExperimentRun(wanted, output, "mine.yaml", Cluster())


FLEET = {"cars": 2, "years": 3, "length": 100.0}


def test_a_fleet_drives_every_year(town):
    ages = []

    def age(drive, years, *given):
        ages.append(years)
        return not_yet(drive)

    (found,) = compared(town, age, database={"fleet": FLEET})
    # The first drives go through the city of today, 3 years before the query.
    assert ages == [1, 1, 2, 2, 3]
    database = found.drives[:-1]
    assert len({one.name for one in database}) == 6
    assert {one.transient.leaves for one in database} == {0.0, 1.0}
    assert len({repr(one.route) for one in database}) > 1


def test_a_greater_fleet_has_the_drives_of_a_smaller_one(town):
    small, more_cars, other = compared(
        town,
        not_yet,
        database={
            "fleet": [
                {"cars": 1, "years": 1, "length": 100.0},
                {"cars": 2, "years": 1, "length": 100.0},
                {"cars": 1, "years": 1, "length": 100.0, "seed": 7},
            ]
        },
    )
    names = [
        {drive.name for drive in one.drives[:-1]}
        for one in (small, more_cars, other)
    ]
    assert names[0] < names[1]
    assert not names[0] & names[2]


FAULTS = [
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
        {"sessions": [{"years": 3}, {"years": 3}]},
        r"database\.sessions\.2: the same drive as database\.sessions\.1",
    ),
    (
        {"sessions": [{}, {"years": 2}, {"viewpoint": "near"}]},
        r"database\.sessions\.3: the same drive as database\.sessions\.1",
    ),
    (
        {"sessions": [{"years": 3}, {"distractors": 5}]},
        r"database\.sessions\.2\.distractors: all drives share it",
    ),
    ({"sessions": [{"keep": 1}]}, r"database\.sessions\.1\.keep: all drives"),
    ({"sessions": [{"rates": 2}]}, r"database\.sessions\.1\.rates: all dri"),
    ({"years": -1, "sessions": [{"years": 2}]}, r"database\.years: -1 is"),
    ({"sessions": [{"years": 201}]}, r"database\.sessions\.1\.years: 201 is"),
    ({"sessions": [{"years": True}]}, r"database\.sessions\.1\.years: True"),
    (
        {"sessions": [{"hide_sector": 30}]},
        r"database\.sessions\.1\.hide_sector: it is a field of query",
    ),
    ({"sessions": [{"snow": 1}]}, r"database\.sessions\.1: snow: "),
    ({"keep": 0}, r"database\.keep: 0 is neither all, latest nor a whole"),
    ({"keep": True}, r"database\.keep: True is neither"),
    ({"keep": "newest"}, r"database\.keep: 'newest' is neither"),
    (
        {"sessions": [{}, {"years": 2}], "maintain": "magic"},
        r"database\.maintain: 'magic' is none of none, free-space, distance",
    ),
    (
        {"sessions": [{"years": 2}], "maintain": "truth"},
        r"database\.maintain: truth: no later drive updates the map of a",
    ),
    ({"maintain": "distance"}, r"database\.maintain: distance: no later"),
    ({"sessions": [{"maintain": "none"}, {}]}, r"1\.maintain: all drives"),
]


@pytest.mark.parametrize(("database", "fault"), FAULTS)
def test_faults_are_one_line_with_file_and_field(town, database, fault):
    with pytest.raises((InputError, ValueError), match=fault) as error:
        compared(town, database=database)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "fields",
    [
        {"database": {"sessions": [{"years": 9}, {"years": 4}]}, "years": 5},
        {"database": {"sessions": [{"years": 0}]}, "years": 1},
        {"database": {"sessions": [{}, {"stage": "04"}]}, "stage": "01"},
    ],
)
def test_no_session_is_later_than_the_query(town, fields):
    query = {n: one for n, one in fields.items() if n != "database"}
    with pytest.raises(InputError, match="this drive is later than the query"):
        compared(town, database=fields["database"], query=query)


def test_drives_differ_before_their_cities_are_aged(town):
    """As in the first look at an experiment, when no map is made yet."""
    (found,) = compared(
        town,
        not_yet,
        database={"sessions": [{"years": 9}, {"years": 4}, {"years": 0}]},
    )
    assert len(found.drives) == 4
    twice = {"sessions": [{"years": 9}, {"years": 4}, {"years": 4}]}
    with pytest.raises(InputError, match=r"3: the same drive as .*2$"):
        compared(town, not_yet, database=twice)


def test_drives_differ_before_their_cities_are_redrawn(town):
    sessions = [{}, {"redraw": 1}, {"redraw": 2}]
    wanted = {"sessions": sessions}
    (found,) = compared(town, not_yet, not_yet, database=wanted)
    assert len(found.drives) == 4
    twice = {"sessions": [*sessions, {"redraw": 1}]}
    for redraw in (redrawn, not_yet):
        with pytest.raises(InputError, match=r"4: the same drive as .*2$"):
            compared(town, not_yet, redraw, database=twice)


@pytest.mark.parametrize("side", ["both", "query"])
def test_sessions_are_those_of_the_database(town, side):
    with pytest.raises(InputError, match=rf"{side}\.\w+: it is a field of da"):
        compared(town, **{side: {"sessions": [{"years": 2}]}})


@pytest.mark.parametrize("task", ["map", "change"])
def test_tasks_on_two_drives_refuse_more(town, task):
    wanted = experiment(
        tasks=[task], database={"sessions": [{"years": 2}, {"years": 1}]}
    )
    with pytest.raises(InputError, match=f"tasks: {task}: it compares two"):
        plan_study(run_of(wanted, town))


@pytest.fixture
def jobs_done(monkeypatch):
    """The names of the jobs of each run, which run in this process."""
    runs = []
    monkeypatch.setattr(
        engine,
        "run_jobs",
        lambda jobs, cluster, unit="": runs.append(studies.do(jobs)),
    )
    monkeypatch.setattr(
        study_module, "write_page", lambda *given, **options: given[2]
    )
    return runs


SIMULATED = {
    "methods": ["solid"],
    "protocol": {"query_spacing": 5.0, "place_spacing": 2.0},
}


def measure(town, output, **fields):
    wanted = experiment(maps=[str(town)], **SIMULATED, **fields)
    run_study(wanted, output, Cluster())
    return Results.read(output / "results.csv")


@pytest.mark.night
@pytest.mark.slow
def test_rows_of_one_session_are_those_without_sessions(
    town, tmp_path, jobs_done
):
    """Bit for bit, in both tables."""
    tables = []
    for name, database in (
        ("plain", {"viewpoint": "lane"}),
        ("one", {"sessions": [{"viewpoint": "lane"}], "keep": "all"}),
    ):
        measure(
            town, tmp_path / name, database=database, tasks=["place", "pose"]
        )
        tables.append(
            [
                (tmp_path / name / file).read_bytes()
                for file in ("results.csv", "queries.csv")
            ]
        )
    assert tables[0] == tables[1]


@pytest.mark.night
@pytest.mark.slow
def test_places_memory_and_answers_of_several_sessions(
    town, tmp_path, jobs_done
):
    near, lane = {"viewpoint": "near"}, {"viewpoint": "lane"}
    results = measure(
        town,
        tmp_path,
        database={"sessions": [[near], [lane], [near, lane]]},
        tasks=["place", "localise"],
    )
    (jobs,) = jobs_done
    # Each drive is described once, for all conditions.
    described = [one for one in jobs if one.startswith("describe ")]
    assert len(described) == 3

    def of(metric, task, method="solid"):
        rows = results.where(metric=metric, task=task, method=method).rows
        return [row.value for row in rows if not row.verified]

    places = of("places", "place")
    assert places[2] == places[0] + places[1]
    memory = of("memory", "cost")
    assert memory[2] == memory[0] + memory[1] > 0
    assert min(of("query_time", "cost")) > 0.0
    assert all(0.0 <= one <= 1.0 for one in of("r1", "place"))
    # A map with more drives localises each query near one of them.
    assert len(of("success_03m_1deg", "localise", "icp")) == 3


def test_a_file_with_sessions_is_read(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        "database:\n  sessions: [{years: 10}, {years: 5}]\n  keep: [all, 1]\n"
        "quick:\n  database: {sessions: [{years: 10}], keep: [all]}\n"
    )
    assert len(load_experiment(path).conditions) == 2
    quick = load_experiment(path, quick=True)
    (one,) = quick.conditions
    assert one.changes["database"]["sessions"] == {"1": {"years": 10}}
    assert load_experiment(path, ["database.keep=latest"])


def test_jobs_in_a_maintained_map_wait_for_it(town, tmp_path):
    wanted = experiment(
        maps=[str(town)],
        database={
            "sessions": [{"viewpoint": "near"}, {"viewpoint": "lane"}],
            "maintain": ["none", "distance"],
        },
        tasks=["place", "localise"],
        **SIMULATED,
    )
    jobs = plan_study(run_of(wanted, tmp_path))[0].jobs
    (upkeep,) = [name for name in jobs if name.startswith("upkeep ")]
    waiting = [one.name for one in jobs.values() if upkeep in one.needs]
    kinds = sorted(name.partition(" ")[0] for name in waiting)
    # The places of both drives are described in the updated map.
    assert kinds == ["describe", "describe", "localise"]


@pytest.mark.slow
def test_maps_are_maintained(town, tmp_path, jobs_done):
    """Cars park elsewhere on the second day, as they do at the query."""
    days = [{"viewpoint": "near"}, {"viewpoint": "lane"}]
    days[1]["transient"] = {"parked_cars": 1.0}
    fields = {
        "database": {
            "sessions": days,
            "maintain": ["none", "distance", "truth"],
        },
        "query": {"transient": {"parked_cars": 1.0}},
    }
    results = measure(town, tmp_path, **fields)
    (jobs,) = jobs_done
    upkeep = [one for one in jobs if one.startswith("upkeep ")]
    assert len(upkeep) == 2
    rows = results.where(metric="places", task="place", verified=False).rows
    # No place is added or lost.
    assert len(rows) == 3
    assert len({row.value for row in rows}) == 1
    # A second run has nothing to do.
    measure(town, tmp_path, **fields)
    assert jobs_done[1] == []
