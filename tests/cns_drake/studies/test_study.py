"""`cns-drake study`: whole experiments on a small town, and their tables."""

from collections import Counter
import math
import shutil

from helpers.counting_method import COUNTING
from helpers.measured_pairs import compare_maps, place_outcome
from helpers.small_map import write_town
import numpy as np
import pytest

from cns_drake.scenarios import load_scenario
from cns_drake.simulation import SimulationSource
from cns_drake.studies import run_study
from evaluation.base import Cluster, InputError
from evaluation.change import DriveMap
from evaluation.maps import CELL_SIZE, VoxelAccumulator
from evaluation.methods import make_method
from evaluation.recognition import RetrievalProtocol
from evaluation.results import QueryRows, Results
from evaluation.study import Experiment

TABLES = ("results.csv", "queries.csv")


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """Folder of a map with two drives of 24 frames along one route."""
    routes = {"01": "metropolis_04", "04": "metropolis_04"}
    return write_town(tmp_path_factory.mktemp("maps") / "town", routes, 24)


def experiment(town, **fields):
    return Experiment.model_validate(
        {"name": "mine", "maps": [str(town)], "methods": ["solid"], **fields}
    )


def measure(wanted, output, **options):
    """Runs an experiment; returns its rows."""
    run_study(wanted, output, Cluster(), **options)
    return Results.read(output / "results.csv")


def values(results, **columns):
    """Metric -> value of the rows with these values of columns."""
    named = {name.replace("__", "."): one for name, one in columns.items()}
    found = results.where(**named).rows
    assert len({row.metric for row in found}) == len(found)
    return {row.metric: row.value for row in found}


def contents(folder):
    return [(folder / name).read_bytes() for name in TABLES]


STAGES = {
    "drives": "stages",
    "database": {"stage": ["last", "own"]},
    "protocol": {"base": "recorded", "query_spacing": 5},
}


@pytest.mark.slow
def test_the_numbers_are_those_of_the_single_commands(
    town, tmp_path, jobs_done
):
    wanted = experiment(
        town,
        **STAGES,
        tasks=["place", "pose", "change"],
        methods={"btc": {}, "solid": {"ranges": [20, 40]}},
    )
    results = measure(wanted, tmp_path)
    database, query = (
        load_scenario(town / f"sequence_{k}.yaml") for k in ("01", "04")
    )
    assert {(r.map, r.database, r.query) for r in results.rows} == {
        ("town", "town_01", "town_04")
    }
    assert {row.protocol for row in results.rows} == {"own"}
    protocol = RetrievalProtocol(query_spacing=5)
    drives = {
        "own": SimulationSource(database)(),
        "last": SimulationSource(database.replaced(stage="04"))(),
        "query": SimulationSource(query)(),
    }
    mapped = {}
    for name, drive in drives.items():
        voxels = VoxelAccumulator(CELL_SIZE)
        for frame in range(len(drive)):
            voxels.add(drive.scan(frame), drive.X_WS[frame])
        mapped[name] = DriveMap(name, voxels.to_map(), drive.X_WS[:, :3, 3])
    for stage in ("last", "own"):
        there = {"database__stage": stage, "verified": False}
        found = values(results, **there, task="change")
        change = compare_maps(mapped[stage], mapped["query"]).change
        assert found["tcr_sym"] == pytest.approx(change.symmetric, abs=1e-9)
        for ranges in (20, 40):
            alone = place_outcome(
                drives[stage],
                drives["query"],
                make_method("solid", {"ranges": str(ranges)}),
                protocol=protocol,
            ).outcomes
            with_it = {**there, "methods__solid__ranges": ranges}
            found = values(results, **with_it, task="place")
            assert found["auc"] == pytest.approx(alone.curve.auc, abs=1e-9)
            assert found["r1"] == pytest.approx(alone.recall_at(1), abs=1e-9)
            before = values(
                results,
                **{**with_it, "database__stage": "last"},
                task="place",
            )
            assert found["relative_auc"] == pytest.approx(
                found["auc"] / before["auc"], abs=1e-6
            )
    # Stage 01 lacks towers that the query sees.
    assert found["visible_change"] > before["visible_change"]
    assert found["visible_change_added"] == pytest.approx(
        found["visible_change"] - before["visible_change"], abs=1e-6
    )
    assert before["visible_change_added"] == 0.0
    # Answers of a method are those that its numbers count.
    queries = QueryRows.read(tmp_path / "queries.csv")
    # Two gates, two stages, three methods.
    assert len(queries.answers) == 2 * 2 * 3
    for one in queries.answers:
        (row,) = [
            row
            for row in results.rows
            if row.metric == "r1" and row.identity == one.identity
        ]
        assert np.mean(one.columns["correct"]) == pytest.approx(
            row.value * row.n / len(one.columns["correct"])
        )


@pytest.mark.slow
def test_finished_work_is_not_repeated(town, tmp_path, jobs_done):
    folder = shutil.copytree(town, tmp_path / "town")
    wanted = experiment(folder, **STAGES, tasks=["place", "change"])
    output = tmp_path / "out"
    measure(wanted, output)
    # Two databases are compared with one query.
    assert jobs_done == [
        ["town 04"],
        ["town 04 in town 01, stage last", "town 04 in town 01, stage own"],
    ]
    tables = contents(output)

    def again(wanted):
        """Measures, and returns the kinds of results that are new."""
        before = {*output.rglob("*.data")}
        measure(wanted, output)
        new = {*output.rglob("*.data")} - before
        return Counter(path.parent.name for path in new)

    assert again(wanted) == {}
    assert (jobs_done[-2:], contents(output)) == ([[], []], tables)
    # Poses are known with the places.
    assert again(wanted.replaced(tasks={"pose": {}})) == {}
    # Other settings of a method.
    other = again(wanted.replaced(methods={"solid": {"ranges": 20}}))
    queries = {"descriptors": 1, "describingtime": 1}
    assert other == {"place": 2, "search": 2, **queries}
    # A folder that has moved.
    output = output.rename(tmp_path / "moved")
    assert again(wanted) == {}
    assert contents(output) == tables
    # Another city at one stage.
    stage = folder / "stage_01.sdf"
    text = stage.read_text()
    stage.write_text(text.replace("</world>", "<!-- Changed. --></world>"))
    assert again(wanted) == {"place": 1, "search": 1, "change": 1}
    assert contents(output) == tables


@pytest.mark.night
@pytest.mark.slow
def test_protocols_are_factors(town, tmp_path, jobs_done):
    """Each radius has numbers and a baseline of its own."""
    fields = STAGES | {"protocol": {"base": "recorded", "radius": [2.0, 9.0]}}
    results = measure(experiment(town, **fields), tmp_path)
    database, query = (
        SimulationSource(load_scenario(town / f"sequence_{k}.yaml"))()
        for k in ("01", "04")
    )
    for radius in (2.0, 9.0):
        alone = place_outcome(
            database,
            query,
            make_method("solid", {}),
            protocol=RetrievalProtocol(radius=radius),
        ).outcomes
        own, last = (
            values(
                results,
                protocol__radius=radius,
                database__stage=stage,
                verified=False,
            )
            for stage in ("own", "last")
        )
        assert own["auc"] == pytest.approx(alone.curve.auc, abs=1e-9)
        assert own["with_match"] == alone.num_matched
        assert last["relative_auc"] == 1.0
        assert own["relative_auc"] == pytest.approx(
            own["auc"] / last["auc"], abs=1e-6
        )


@pytest.mark.slow
@pytest.mark.night
def test_queries_are_scored_once_for_all_radii(town, tmp_path, jobs_done):
    """The numbers are those of a study of each radius alone."""
    fields = {"tasks": ["place", "pose", "cost"], "methods": ["ring++"]}

    def found(radii, folder):
        protocol = {"base": "random-yaw", "radius": radii}
        wanted = experiment(town, **fields, protocol=protocol)
        rows = measure(wanted, tmp_path / folder).rows
        answers = (tmp_path / folder / "queries.csv").read_text().splitlines()
        return [row for row in rows if row.task != "cost"], answers

    both, answers = found([2.0, 9.0], "both")
    assert len(jobs_done[1]) == 1
    for radius in (2.0, 9.0):
        alone, own_answers = found(radius, f"{radius}")
        assert {row.verified for row in alone} == {False, True}
        of_radius = [row for row in both if row["protocol.radius"] == radius]
        assert [
            (row.task, row.verified, row.metric, repr(row.value), repr(row.low))
            for row in of_radius
        ] == [
            (row.task, row.verified, row.metric, repr(row.value), repr(row.low))
            for row in alone
        ]
        assert len(answers) - 1 == 2 * (len(own_answers) - 1)


@pytest.mark.slow
def test_a_condition_without_draws_is_measured_once(town, tmp_path, jobs_done):
    wanted = experiment(
        town,
        query={"transient": {"snow": [0, 0.2]}},
        seeds=[4, 5, 6],
        protocol={"base": "random-yaw", "query_spacing": 20},
    )
    results = measure(wanted, tmp_path)
    found = {
        (row.factors["query.transient.snow"], row.seed) for row in results.rows
    }
    assert found == {(0, 4), (0.2, 4), (0.2, 5), (0.2, 6)}
    # Each draw is compared with the only baseline.
    for seed in (4, 5, 6):
        before, after = (
            values(
                results,
                query__transient__snow=snow,
                seed=one,
                verified=False,
            )
            for snow, one in ((0, 4), (0.2, seed))
        )
        if before["auc"]:
            assert after["relative_auc"] == pytest.approx(
                after["auc"] / before["auc"], abs=1e-6
            )
    # In another order, they are the same.
    measure(wanted.replaced(seeds=(6, 4, 5)), tmp_path)
    assert jobs_done[-2:] == [[], []]


@pytest.mark.slow
def test_each_lidar_is_compared_with_its_own_baseline(
    town, tmp_path, jobs_done
):
    wanted = experiment(
        town,
        both={"lidars": {"*": {"preset": ["vlp-16", "os1-32"]}}},
        database={"stage": ["own", "last"]},
        protocol={"base": "random-yaw", "query_spacing": 20},
        baseline={"database.stage": "last"},
    )
    measure(wanted, tmp_path)
    results = Results.read(tmp_path)
    assert {row.baseline for row in results.rows} == {"database.stage=last"}
    for lidar in ("vlp-16", "os1-32"):
        own, last = (
            values(
                results.where({"both.lidars.*.preset": lidar}),
                database__stage=s,
                verified=0,
            )
            for s in ("own", "last")
        )
        assert last["auc"] > 0.0
        assert own["relative_auc"] == pytest.approx(
            own["auc"] / last["auc"], abs=1e-6
        )
    # What is compared with itself has no interval.
    controls = results.where({"database.stage": "last"}, metric="relative_auc")
    assert len(controls.rows) == 2 * len(results.distinct("verified"))
    for row in controls.rows:
        assert (row.value, math.isnan(row.low)) == (1.0, True)


def test_a_setting_is_compared_with_that_of_the_baseline(
    town, tmp_path, jobs_done
):
    setting = "methods.scan-context++.candidates"
    wanted = experiment(
        town,
        methods={"scan-context++": {"candidates": [5, 1]}},
        query={"transient": {"snow": [0.0, 0.3]}},
        protocol={"base": "random-yaw", "query_spacing": 5},
        baseline={setting: 1},
    )
    results = measure(wanted, tmp_path)
    assert {row.baseline for row in results.rows} == {f"{setting}=1"}
    for snow in (0.0, 0.3):
        here = results.where({"query.transient.snow": snow}, verified=0)
        five, one = (
            {row.metric: row for row in here.where({setting: number}).rows}
            for number in (5, 1)
        )
        assert one["auc"].value > 0.0
        assert five["relative_auc"].value == pytest.approx(
            five["auc"].value / one["auc"].value, abs=1e-6
        )
        control = one["relative_auc"]
        assert (control.value, math.isnan(control.low)) == (1.0, True)


def test_a_drive_is_compared_with_itself(town, tmp_path, jobs_done):
    """The only pair: its one drive is read into memory."""
    wanted = experiment(
        town,
        tasks={"change": {"spacing": 5}, "place": {}},
        protocol={"base": "recorded", "query_spacing": 5, "place_spacing": 5},
    )
    found = values(measure(wanted, tmp_path), task="change")
    assert found["tcr_sym"] == 0.0


def test_an_unchanged_city_has_no_change(town, tmp_path, jobs_done):
    wanted = experiment(
        town,
        tasks={"change": {"spacing": 5}},
        database={"offset": {"yaw_deg": [0, 180]}},
        methods=["solid"],
    )
    results = measure(wanted, tmp_path)
    for yaw_deg in (0, 180):
        found = values(results, database__offset__yaw_deg=yaw_deg)
        assert found["tcr_sym"] == 0.0
    assert {row.method for row in results.rows} == {""}


@pytest.mark.slow
def test_maps_are_labelled(town, tmp_path, jobs_done):
    names = ["truth", "free-space", "distance"]
    results = measure(
        experiment(
            town,
            tasks={"map": {"spacing": 20, "methods": names}},
            both={"lidars": {"lidar": {"columns": 128}}},
            cases={"construction": {"database": {"stage": "first"}}},
        ),
        tmp_path,
    )
    found = {
        (cause, method): values(results, cause=cause, method=method)
        for cause in ("none", "construction")
        for method in names
    }
    assert {(r.factors["cause"], r.method) for r in results.rows} == set(found)
    for cause in ("none", "construction"):
        truth = found[cause, "truth"]
        assert truth["miou"] == truth["right_structures"] == 1.0
    before, after = (found[c, "truth"] for c in ("none", "construction"))
    # Nothing changes between two drives through one city.
    assert before["called_points"] == 0.0 < after["called_points"]
    assert before["gone"] == before["new"] == 0.0
    assert after["gone"] + after["new"] > 0.0


@pytest.mark.night
@pytest.mark.slow
def test_scans_are_localised(town, tmp_path, jobs_done):
    own = tmp_path / "stay.py"
    own.write_text("def stay(map, scan, start):\n    return start, 1.0\n")
    wanted = experiment(
        town,
        tasks={
            "localise": {
                "methods": ["gicp", str(own)],
                "starts": [[0.5, 5], [2, 10]],
                "spacing": 10.0,
            }
        },
        database={"stage": ["last", "first"]},
    )
    output = tmp_path / "out"
    results = measure(wanted, output)
    assert {row.method for row in results.rows} == {
        f"{method} from {far} m"
        for method in ("gicp", "stay")
        for far in ("0.5", "2")
    }
    # A start that stays is as far off as it was drawn.
    for far in (0.5, 2):
        found = values(
            results, method=f"stay from {far:g} m", database__stage="last"
        )
        assert found["translation_median"] == pytest.approx(far)
    queries = QueryRows.read(output / "queries.csv")
    for one in queries.answers:
        found = values(
            results,
            method=one.method,
            database__stage=one.factors["database.stage"],
        )
        right = (np.asarray(one.columns["translation_error"]) <= 0.3) & (
            np.asarray(one.columns["rotation_error_deg"]) <= 1.0
        )
        assert np.mean(right) == found["success_03m_1deg"]
        np.testing.assert_array_equal(one.columns["correct"], right)
    tables = contents(output)
    measure(wanted, output)
    assert (jobs_done[-1], contents(output)) == ([], tables)
    # Another text of the own method is another method.
    own.write_text("def stay(map, scan, start):\n    return start, 2.0\n")
    measure(wanted, output)
    assert len(jobs_done[-1]) == 2


def test_an_own_method(town, tmp_path, jobs_done, own_methods):
    own = tmp_path / "counting.py"
    own.write_text(COUNTING)
    wanted = experiment(town, methods={str(own): {"unit": [1.0, 2.0]}})
    results = measure(wanted, tmp_path / "out")
    assert {
        (row.method, row.factors["methods.counting.unit"])
        for row in results.rows
    } == {("counting", 1), ("counting", 2)}


@pytest.mark.parametrize(
    ("fields", "fault"),
    [
        ({"tasks": ["dance"]}, "tasks: no task 'dance' .*place, pose"),
        ({"tasks": {"place": {"x": 1}}}, "tasks.place.x: no setting 'x'"),
        ({"tasks": {"change": {"spacing": 0}}}, "tasks.change.spacing: 0 is"),
        (
            {"tasks": {"change": {"spacing": [1, 2]}}},
            r"tasks.change.spacing: \[1, 2\] is not a positive number",
        ),
        (
            {"tasks": {"map": {"methods": "guess"}}},
            "tasks.map.methods: no method 'guess'",
        ),
        ({"tasks": {"map": {"methods": []}}}, r"tasks.map.methods: \[\] is no"),
        ({"tasks": {"map": {"spacing": True}}}, "tasks.map.spacing: True is"),
        (
            {"tasks": {"localise": {"methods": ["gicp", "gicp"]}}},
            "tasks.localise.methods: 'gicp' is there twice",
        ),
        (
            {"tasks": {"localise": {"methods": "bow"}}},
            "tasks.localise.methods: 'bow' is neither",
        ),
        ({"tasks": {"localise": {"starts": []}}}, "tasks.localise.starts: "),
        ({"tasks": {"localise": {"starts": 2}}}, "tasks.localise.starts: 2 is"),
        (
            {"tasks": {"localise": {"starts": [[51, 0]]}}},
            "tasks.localise.starts: 51 m is not above 0",
        ),
        (
            {"tasks": {"localise": {"starts": [[1, 5], [1, 9]]}}},
            "tasks.localise.starts: two starts at one distance",
        ),
        ({"methods": ["bow"]}, "methods: no method 'bow' .there are: btc"),
        ({"methods": ["bevplace"]}, "methods: bevplace: weights: Field"),
        ({"methods": ["none.py"]}, "methods: .*none.py: no such file"),
        ({"methods": {"solid": {"x": 1}}}, "methods: solid: no parameter 'x'"),
        (
            {"methods": {"solid": {"ranges": [20, "far"]}}},
            "methods: solid: ranges: ",
        ),
        ({"protocol": {"base": "best"}}, "protocol.base: no protocol 'best'"),
        ({"frozen": "no.csv"}, "frozen: .*no.csv: No such file"),
        ({"charts": [{"kind": "pie"}]}, "charts: kind: no kind 'pie'"),
        ({"charts": [{"kind": "matrix"}]}, "charts: matrix: .*a name is"),
        (
            {"charts": [{"kind": "lines", "over": "map", "metric": "acu"}]},
            r"charts: lines: no metric 'acu' \(there are: auc, .*mean auc",
        ),
        (
            {
                "methods": {"solid": {"ranges": [20, 40]}},
                "charts": [
                    {
                        "kind": "lines",
                        "over": "methods.solid.range",
                        "metric": "auc",
                    }
                ],
            },
            r"charts: lines: no factor 'methods.solid.range' \(the experiment"
            r" varies: methods.solid.ranges\)",
        ),
        (
            {"metrics": ["auc", "r2"]},
            "metrics: no metric 'r2' .there are: auc, ",
        ),
        ({"metrics": ["none.py"]}, "metrics: none.py: no such file"),
        (
            {"database": {"asid": [0, 5]}},
            "database: asid: no such field; did you mean aside",
        ),
        ({"query": {"frame": 9}}, "query: frame: no such field; .* frames"),
        (
            {"query": {"lidars": {"lidr": {"xyz": [[0, 0, 1], [0, 0, 2]]}}}},
            r"query.lidars: the drive has no LiDAR 'lidr' \(it has: lidar\);"
            " did you mean lidar",
        ),
    ],
)
def test_faults_before_any_work(town, tmp_path, fields, fault):
    with pytest.raises(InputError, match=f"^mine.yaml: {fault}") as error:
        run_study(
            experiment(town, **fields), tmp_path, Cluster(), source="mine.yaml"
        )
    assert "\n" not in str(error.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("fields", "fault"),
    [
        ({"database": {"foo": 1}}, "mine: database: foo: Extra"),
        (
            {"database": {"frames": [9, 5], "foo": 1}},
            "mine: database: foo: Extra",
        ),
        ({"maps": ["atlantis"]}, "mine: maps: unknown map 'atlantis'"),
        (
            {
                "maps": [
                    {"name": "a", "age": "suburbia", "years": 1, "seed": 1},
                    "atlantis",
                ]
            },
            "mine: maps: unknown map 'atlantis'",
        ),
        (
            {"database": {"city": {"years": 1.5}}},
            "mine: database: city.years: ",
        ),
        ({"query": {"city": {"years": 201}}}, "mine: query: city.years: "),
        (
            {"both": {"city": {"redraw": {"frozen": 1}}}},
            "mine: both.city.redraw.frozen: .*town: no shipped map",
        ),
        (
            {
                "maps": [
                    {"name": "a", "age": "suburbia", "years": 1, "seed": 1}
                ],
                "both": {"city": {"redraw": {"frozen": 1}}},
            },
            "mine: both.city.redraw.frozen: a: no shipped map",
        ),
        (
            {
                "maps": ["suburbia"],
                "both": {"city": {"redraw": {"frozen": [1, 6]}}},
            },
            "mine: both.city.redraw.frozen of suburbia: no frozen redraw 6",
        ),
        (
            {"database": {"stage": "earlier 1"}},
            "mine: no condition that can be measured",
        ),
    ],
)
def test_faults_before_anything_is_made(town, tmp_path, fields, fault):
    with pytest.raises(InputError, match=f"^{fault}"):
        run_study(experiment(town, **fields), tmp_path / "out", Cluster())
    assert not (tmp_path / "out").exists()


def test_a_case_with_fewer_levels_is_noted(town, tmp_path):
    wanted = experiment(
        town,
        cases={
            "snow": {"query": {"transient": {"snow": [0.1, 0.2]}}},
            "driver": {"query": {"driver": {"wander": 0.3}}},
        },
        levels=[2],
    )
    notes = []
    with pytest.raises(InputError, match="no-map"):
        run_study(wanted, tmp_path, Cluster(), ["no-map"], on_note=notes.append)
    assert notes == ["measured at their last level: driver (1)"]


@pytest.mark.parametrize("name", ["results.csv", "queries.csv", "index.html"])
def test_a_folder_with_the_name_of_a_result(town, tmp_path, name):
    (tmp_path / name).mkdir()
    with pytest.raises(InputError, match=f"{name}: a folder has this name"):
        run_study(experiment(town), tmp_path, Cluster())


def test_two_maps_of_one_name(town, tmp_path):
    shutil.copytree(town, tmp_path / "town")
    both = experiment(town, maps=[str(town), str(tmp_path / "town")])
    with pytest.raises(InputError, match=r"another map, .* town, too"):
        run_study(both, tmp_path / "out", Cluster())
    # Nor may two drives share a name, whose results share a file.
    other = shutil.copytree(town, tmp_path / "village")
    (other / "sequence_01.yaml").unlink()
    file = other / "sequence_04.yaml"
    file.write_text(file.read_text() + "name: town_04\n")
    both = experiment(town, maps=[str(town), str(other)])
    with pytest.raises(InputError, match=r"village: another .* town_04, too"):
        run_study(both, tmp_path / "out", Cluster())
    assert not (tmp_path / "out").exists()


def test_a_map_with_one_drive_has_no_stages_to_compare(
    town, tmp_path, jobs_done
):
    lonely = shutil.copytree(town, tmp_path / "lonely")
    (lonely / "sequence_01.yaml").unlink()
    notes = []
    results = measure(
        experiment(town, maps=[str(lonely), str(town)], drives="stages"),
        tmp_path / "out",
        on_note=notes.append,
    )
    assert "lonely: no two drives to compare" in notes
    assert {row.map for row in results.rows} == {"town"}


def test_a_condition_more_leaves_those_before_as_they_are(
    town, tmp_path, jobs_done
):
    """Also where two conditions share a drive, which then is in files."""

    def ask(*depths):
        snow = {"transient": {"snow": [*depths]}}
        measure(experiment(town, query=snow), tmp_path)

    ask(0.1)
    ask(0.2, 0.1)
    assert jobs_done[1::2] == [["town 04, snow 0.1"], ["town 04, snow 0.2"]]
    ask(0.1)
    assert jobs_done[-1] == []
