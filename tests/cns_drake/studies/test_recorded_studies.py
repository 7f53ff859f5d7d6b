"""Experiments on folders of recordings, whose stage alone can vary."""

from helpers.drive_files import make_scan, write_recording
from helpers.internal import studies
from helpers.internal.eval_program import write_towns
from helpers.measured_pairs import place_outcome
from helpers.small_towns import drive
import numpy as np
import pytest

from cns_drake.studies import run_study
from evaluation import change_between
from evaluation.base import Cluster, InputError
from evaluation.drives import open_drive
from evaluation.methods import make_method
from evaluation.recognition import (
    RANDOM_YAW_PROTOCOL,
    MethodChoice,
    RetrievalProtocol,
)
from evaluation.results import Results
from evaluation.study import Experiment


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drives")
    drive(folder / "metropolis_01", "01", "a")
    drive(folder / "metropolis_04_control", "04", "a")
    drive(folder / "metropolis_04", "04", "b")
    return folder


@pytest.fixture(autouse=True)
def in_this_process(jobs_done, unrendered_figures):
    pass


def measure(output, *maps, on_note=lambda text: None, **fields):
    experiment = Experiment.model_validate(
        {
            "name": "mine",
            "maps": [str(path) for path in maps],
            "methods": ["solid"],
            **fields,
        }
    )
    run_study(experiment, output, Cluster(), on_note=on_note)
    return Results.read(output / "results.csv")


def values(results, **columns):
    """Metric -> value of the rows with these values of columns."""
    found = results.where(**columns).rows
    assert len({row.metric for row in found}) == len(found)
    return {row.metric: row.value for row in found}


@pytest.mark.slow
def test_the_numbers_are_those_of_the_single_commands(folder, tmp_path):
    results = measure(
        tmp_path,
        folder,
        tasks=["place", "change"],
        both={"stage": ["last", "own"]},
    )
    databases = {"own": "metropolis_01", "last": "metropolis_04_control"}
    query = folder / "metropolis_04"
    found = {}
    for stage, name in databases.items():
        here = {"both.stage": stage}
        found[stage] = values(results, **here, task="place", verified=False)
        alone = place_outcome(
            open_drive(folder / name),
            open_drive(query),
            make_method("solid", {}),
            protocol=RANDOM_YAW_PROTOCOL,
        ).outcomes
        assert found[stage]["auc"] == pytest.approx(alone.curve.auc, abs=1e-9)
        change = change_between(folder / name, query)
        assert values(results, **here, task="change")["tcr_sym"] == (
            pytest.approx(change.metrics["tcr_sym"], abs=1e-9)
        )
    kept = found["own"]["auc"] / found["last"]["auc"]
    assert found["own"]["relative_auc"] == pytest.approx(kept, abs=1e-6)
    assert {(row.map, row.database, row.query) for row in results.rows} == {
        ("metropolis", "metropolis_01", "metropolis_04")
    }


@pytest.mark.slow
@pytest.mark.night
def test_a_report_writes_the_tables_of_the_stages(folder, tmp_path):
    """Rows and answers of both ways, with and without verification."""
    for names in (["btc", "solid"], ["solid"]):
        output = tmp_path / str(len(names))
        fields = {"tasks": ["place", "pose", "change"], "methods": names}
        stages = {"drives": "both-ways", "both": {"stage": ["last", "own"]}}
        results = measure(
            output / "study", folder, **{"name": "stages", **fields, **stages}
        )
        assert len({row.query for row in results.rows}) == 2
        studies.report(folder, output / "report", map(MethodChoice, names))
        for table in ("results.csv", "queries.csv"):
            one, other = (
                (output / path / table).read_text()
                for path in ("study", "report")
            )
            assert one == other, table


@pytest.mark.slow
def test_both_ways_need_no_map(folder, tmp_path):
    """Each drive has places and queries, which lie apart differently."""
    for tasks in (["place"], ["place", "change"]):
        output = tmp_path / str(len(tasks))
        measure(output, folder, tasks=tasks, drives="both-ways")
    one, other = (
        Results.read(tmp_path / name / "results.csv").where(task="place").rows
        for name in "12"
    )
    assert len({row.query for row in one}) == 2
    assert one == other


def test_protocols_may_vary(folder, tmp_path):
    results = measure(
        tmp_path,
        folder,
        protocol={"base": "recorded", "radius": [5.0, 15.0]},
    )
    for radius in (5.0, 15.0):
        alone = place_outcome(
            open_drive(folder / "metropolis_01"),
            open_drive(folder / "metropolis_04"),
            make_method("solid", {}),
            protocol=RetrievalProtocol(radius=radius),
        ).outcomes
        found = values(results, **{"protocol.radius": radius}, verified=False)
        assert found["auc"] == pytest.approx(alone.curve.auc, abs=1e-9)
        assert found["with_match"] == alone.num_matched


def test_the_last_stage_alone(folder, tmp_path):
    """A fixed stage counts, too."""
    fields = {"protocol": "recorded"}
    one = measure(tmp_path / "one", folder, both={"stage": "last"}, **fields)
    both = measure(
        tmp_path / "both", folder, both={"stage": ["last", "own"]}, **fields
    )
    assert values(one, verified=False) == values(
        both, **{"both.stage": "last"}, verified=False
    )


def test_drives_without_a_control(tmp_path):
    write_towns(tmp_path / "drives")
    notes = []
    results = measure(
        tmp_path / "out",
        tmp_path / "drives",
        both={"stage": ["last", "own"]},
        on_note=notes.append,
    )
    assert notes == [
        "world: all poses are in frame 'map', which drives share",
        "town: no drive on the route of town_01 in the stage of town_02",
    ]
    assert {row.factors["both.stage"] for row in results.rows} == {"own"}
    assert "relative_auc" not in {row.metric for row in results.rows}


@pytest.mark.parametrize(
    ("fields", "fault"),
    [
        (
            {"query": {"transient": {"snow": [0, 0.2]}}},
            "query.transient.snow: the recordings of metropolis are as",
        ),
        ({"query": {"transient": {"snow": 0.2}}}, "query.transient: the rec"),
        (
            {"database": {"city": {"years": [0, 5]}}},
            "database.city.years: the recordings",
        ),
        ({"database": {"distractors": 9}}, "database.distractors: the rec"),
        ({"query": {"offset": {"left": 9}}}, "query.offset: the recordings"),
        ({"database": {"keep": 2}}, "database.keep: .* database.sessions; "),
        ({"query": {"stage": "last"}}, "query.stage: the recordings"),
        ({"database": {"stage": "last"}}, "database.stage: the recordings"),
        (
            {"both": {"lidars": {"*": {"preset": "vlp-16"}}}},
            "both.lidars: the recordings",
        ),
        ({"cases": {"a": {"database": {"stage": "last"}}}}, "cause: the rec"),
        (
            {"both": {"stage": "01"}},
            "both.stage: .01.: recordings have",
        ),
        ({"both": {"stage": ["own", "first"]}}, "both.stage: 'first'"),
        (
            {"both": {"city": {"redraw": {"frozen": [1]}}}},
            "both.city.redraw.frozen: .*: no shipped map",
        ),
    ],
)
def test_recordings_are_as_they_are(folder, tmp_path, fields, fault):
    with pytest.raises(InputError, match=f"^mine: {fault}") as error:
        measure(tmp_path / "out", folder, **fields)
    assert "\n" not in str(error.value)


def test_folders_without_two_stages(folder, tmp_path):
    drive(tmp_path / "drives" / "metropolis_04_b", "04", "b")
    notes = []
    with pytest.raises(InputError, match="mine: no condition that can be meas"):
        measure(tmp_path / "out", tmp_path / "drives", on_note=notes.append)
    assert notes == ["metropolis: no two drives to compare"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="empty: no recorded drive in it"):
        measure(tmp_path / "out", tmp_path / "empty")


def test_a_folder_given_twice(folder, tmp_path):
    with pytest.raises(InputError, match=r"another map, .* metropolis, too"):
        measure(tmp_path / "out", folder, f"{folder}/.")


SESSIONS = [["metropolis_01"], ["metropolis_01", "metropolis_04_control"]]


@pytest.mark.slow
def test_several_recordings_are_a_database(folder, tmp_path):
    """One session is the drive by itself; both have the places of both."""
    results = measure(
        tmp_path / "both",
        folder,
        tasks={"place": {}, "localise": {"methods": ["icp"]}},
        database={"sessions": SESSIONS, "keep": ["all", 1]},
    )
    alone = measure(tmp_path / "alone", folder, tasks=["place"])
    one, two = (f"[{','.join(names)}]" for names in SESSIONS)

    def of(sessions, keep, task="place"):
        where = {"database.sessions": sessions, "database.keep": keep}
        return values(
            results, **where, task=task, verified=False, method="solid"
        )

    single = values(alone, task="place", verified=False)
    expected = {name: single[name] for name in ("auc", "r1", "visible_change")}
    assert expected.items() <= of(one, "all").items()
    assert of(two, "all")["places"] == 2.0 * single["places"]
    # Both follow one route, so each cell has a place of each.
    assert of(two, 1)["places"] == single["places"]
    assert of(two, "all", "cost")["memory"] == pytest.approx(
        2.0 * of(one, "all", "cost")["memory"], rel=0.01
    )
    assert results.where(task="localise", method="icp").rows


@pytest.mark.parametrize(
    ("sessions", "fault"),
    [
        (["metropolis_01", "metropolis_01"], "metropolis_01: the same drive"),
        (["metropolis_4"], "metropolis: no recording 'metropolis_4'"),
        (["metropolis_04"], "metropolis_04: this drive is the query"),
        ([[]], "a list without a value"),
        ([{"frames": 3}], "not a list of names of recordings"),
    ],
)
def test_faults_of_recorded_sessions(folder, tmp_path, sessions, fault):
    with pytest.raises(
        (InputError, ValueError), match=rf"database\.sessions: {fault}"
    ) as error:
        measure(tmp_path, folder, database={"sessions": sessions})
    if isinstance(error.value, InputError):
        assert "\n" not in str(error.value)


def write_town(folder, number, **options):
    """Writes a drive of two scans through stage `number` of a town."""
    scans = [make_scan(np.ones((9, 3))), make_scan(np.ones((9, 3)))]
    write_recording(
        folder / f"town_{number}", scans, [np.eye(4)] * 2, **options
    )


def test_sessions_of_another_frame(tmp_path):
    write_town(tmp_path / "in", 1)
    write_town(tmp_path / "in", 2, world_frame="utm")
    write_town(tmp_path / "in", 3)
    with pytest.raises(InputError, match="town_2: cannot be aligned") as error:
        measure(
            tmp_path / "out",
            tmp_path / "in",
            database={"sessions": ["town_1", "town_2"]},
        )
    assert "\n" not in str(error.value)


def test_sessions_later_than_the_query(tmp_path):
    """By the clock, if it is one: drives with times from 0 on are undated."""
    year_ns = 365 * 86_400 * 10**9
    for number, years in ((1, 50), (2, 52), (3, 51)):
        stamps = [years * year_ns, years * year_ns + 10**8]
        write_town(tmp_path / "in", number, stamps_ns=stamps)
    with pytest.raises(
        InputError,
        match="sessions: town_2: this drive is later than the query town_3",
    ):
        measure(
            tmp_path / "out",
            tmp_path / "in",
            database={"sessions": ["town_1", "town_2"]},
        )


@pytest.mark.night
@pytest.mark.slow
def test_a_recording_is_read_once(folder, tmp_path):
    """A further method leaves what others found, as in a study of its own."""
    fields = {
        "drives": "both-ways",
        "both": {"stage": ["last", "own"]},
        "tasks": ["place", "change"],
    }
    both = ["solid", "scan-context++"]
    whole = measure(tmp_path / "whole", folder, **{**fields, "methods": both})
    measure(tmp_path / "later", folder, **fields)
    parts = tmp_path / "later" / "parts"
    features = sorted(path.name for path in (parts / "features").iterdir())
    assert features == sorted(path.name for path in folder.iterdir())
    assert not (parts / "mapped").exists()
    kept = {
        path: path.read_bytes() for path in sorted((parts / "place").iterdir())
    }
    later = measure(tmp_path / "later", folder, **{**fields, "methods": both})
    assert later == whole
    assert all(path.read_bytes() == data for path, data in kept.items())


def test_drives_are_read_anew_for_another_protocol(folder, tmp_path):
    """Jobs describe by the first protocol; results are those of each."""
    spacings = [10.0, 20.0]
    fields = {"protocol": {"base": "recorded", "query_spacing": spacings}}
    found = measure(tmp_path, folder, tasks=["place"], **fields)
    for spacing in spacings:
        alone = place_outcome(
            open_drive(folder / "metropolis_01"),
            open_drive(folder / "metropolis_04"),
            make_method("solid", {}),
            RetrievalProtocol(query_spacing=spacing),
        ).outcomes
        here = {"protocol.query_spacing": spacing, "verified": False}
        shown = values(found, **here)
        assert shown["auc"] == pytest.approx(alone.curve.auc, abs=1e-9)
        assert shown["with_match"] == alone.num_matched
