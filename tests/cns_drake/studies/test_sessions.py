"""Several drives in a database: which they are, their order, and their rows."""

from helpers.small_map import write_town
import pytest

from cns_drake.studies import run_study
from evaluation.base import Cluster
from evaluation.results import Results
from evaluation.study import Experiment, load_experiment


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """Folder of a map with two drives of 40 frames along one route."""
    routes = {"01": "metropolis_04", "04": "metropolis_04"}
    return write_town(tmp_path_factory.mktemp("maps") / "town", routes, 40)


def experiment(**fields):
    return Experiment.model_validate({"name": "mine", **fields})


def test_sessions_keep_and_their_fields_are_factors(town):
    wanted = experiment(
        database={
            "sessions": [{"city": {"years": [5, 10]}}, {"frames": 9}],
            "keep": ["all", 1],
        }
    )
    assert [one.factors for one in wanted.conditions] == [
        {"database.sessions.1.city.years": years, "database.keep": keep}
        for years in (5, 10)
        for keep in ("all", 1)
    ]
    sets = [[{"frames": 5}], [{"frames": 5}, {"frames": 9}]]
    wanted = experiment(database={"sessions": sets})
    assert [one.factors for one in wanted.conditions] == [
        {"database.sessions": text}
        for text in ("[{frames: 5}]", "[{frames: 5},{frames: 9}]")
    ]


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
        ("plain", {"offset": {"left": 5.0}}),
        ("one", {"sessions": [{"offset": {"left": 5.0}}], "keep": "all"}),
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
    near, lane = {"offset": {"left": 0.5}}, {"offset": {"left": 5.0}}
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
    assert min(of("query_time", "cost") + of("build_time", "cost")) > 0.0
    assert all(0.0 <= one <= 1.0 for one in of("r1", "place"))
    # A map with more drives localises each query near one of them.
    assert len(of("success_03m_1deg", "localise", "icp")) == 3


def test_a_file_with_sessions_is_read(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        "database:\n  sessions: [{frames: 10}, {frames: 5}]\n  keep: [all, 1]\n"
        "quick:\n  database: {sessions: [{frames: 10}], keep: [all]}\n"
    )
    assert len(load_experiment(path).conditions) == 2
    quick = load_experiment(path, quick=True)
    (one,) = quick.conditions
    assert one.changes["database"]["sessions"] == {"1": {"frames": 10}}
    assert load_experiment(path, ["database.keep=latest"])


@pytest.mark.slow
def test_maps_are_maintained(town, tmp_path, jobs_done):
    """Cars park elsewhere on the second day, as they do at the query."""
    days = [{"offset": {"left": 0.5}}, {"offset": {"left": 5.0}}]
    days[1]["transient"] = {"parked_cars": 1.0}
    fields = {
        "database": {
            "sessions": days,
            "maintain": ["none", "distance", "truth"],
        },
        "query": {"transient": {"parked_cars": 1.0}},
    }
    results = measure(town, tmp_path, **fields)
    assert len([*(tmp_path / "parts" / "upkeep").iterdir()]) == 2
    rows = results.where(metric="places", task="place", verified=False).rows
    # No place is added or lost.
    assert len(rows) == 3
    assert len({row.value for row in rows}) == 1
    # A second run has nothing to do.
    measure(town, tmp_path, **fields)
    assert jobs_done[-2:] == [[], []]
