"""`cns-drake reproduce`: one graph of jobs from recordings to figures."""

import csv

from helpers import studies
from helpers.small_map import write_small_map, write_town
import numpy as np
import pytest
import yaml

from cns_drake.base.errors import InputError
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.step import Reporter
from cns_drake.scenarios.planning import plan_drive
from cns_drake.scenarios.scenario_files import load_scenario
from cns_drake.scenarios.sections import DriverConfig
from cns_drake.simulation.simulated_drive import SimulationSource
from cns_drake.simulation.simulation import simulate
from cns_drake.studies.recordings import reproduction
from cns_drake.studies.recordings.recording import Record
from cns_drake.studies.recordings.reproduction import (
    control_drives,
    recording_info,
)
from evaluation.methods import registry
from evaluation.recognition.protocol import FAIR_PROTOCOL
from evaluation.study.recordings.map_drives import drives_by_map
from evaluation.study.recordings.recording_search import find_recordings

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """Folder of a map with two drives of a few frames."""
    routes = {"01": "metropolis_01", "04": "metropolis_04"}
    return write_town(tmp_path_factory.mktemp("maps") / "town", routes, 3)


@pytest.fixture(scope="module")
def drives(town):
    return [load_scenario(town / f"sequence_{k}.yaml") for k in ("01", "04")]


@pytest.fixture
def planned(monkeypatch):
    """The jobs and recordings of runs; none of them is done."""
    runs = []
    monkeypatch.setattr(
        reproduction,
        "run_jobs",
        lambda jobs, cluster, unit="": runs.append(
            {job.name: job for job in jobs}
        ),
    )

    def assemble(study, pages, on_note, *, with_tables):
        assert not with_tables
        assert callable(on_note)
        assert (study.protocol, study.with_costs) == (FAIR_PROTOCOL, False)
        runs[-1]["recordings"] = {one.name: one for one in study.recordings}
        runs[-1]["pages"] = pages
        return study.output / "report.html"

    monkeypatch.setattr(reproduction.StagesReport, "assemble", assemble)
    return runs


def test_planned_files_are_the_written_ones(drives, tmp_path):
    scenarios = [*drives, *control_drives(drives)]
    for scenario in scenarios:
        simulate(scenario, tmp_path)
    expected = [recording_info(one, tmp_path, False) for one in scenarios]
    found = {one.name: one for one in find_recordings(tmp_path)}
    assert found.keys() == {one.name for one in expected}
    for one in expected:
        other = found[one.name]
        assert (one.path, one.map_name, one.stage, one.needs) == (
            other.path,
            other.map_name,
            other.stage,
            other.needs,
        )
        assert one.source == other.source
    for recordings in (expected, found.values()):
        (city,) = drives_by_map(recordings)
        (pair,) = city.change_pairs()
        assert [one.name for one in pair] == ["town_01", "town_04"]
        database, _ = city.unchanged_pair(*pair)
        assert database.name == "town_01_stage_04"


def test_everything_is_planned_before_anything_runs(
    town, drives, planned, tmp_path, capsys
):
    cluster = Cluster(3)
    arguments = ([str(town)], tmp_path, cluster)
    path = reproduction.reproduce_maps(*arguments)
    assert path == tmp_path / "report" / "report.html"
    (jobs,) = planned
    recordings = jobs.pop("recordings")
    assert jobs.pop("pages") == {}
    names = {"town_01", "town_04", "town_01_stage_04"}
    assert recordings.keys() == names
    for name in names:
        assert jobs[name].needs == ()
        assert jobs[f"features of {name}"].needs == (name,)
    assert "picture town drives" in jobs
    assert "explain town_01 > town_04" in jobs
    for job in jobs.values():
        assert jobs.keys() >= set(job.needs)
    # Each job has its own path, which workers on any machine find.
    outputs = [job.step.output for job in jobs.values()]
    assert len(set(outputs)) == len(outputs)
    assert all(output.is_absolute() for output in outputs)
    # Finished recordings are kept; drives still need their pages.
    for scenario in (*drives, *control_drives(drives)):
        simulate(scenario, tmp_path)
    page = tmp_path / "pages" / "town_01.html"
    Record(drives[0], tmp_path, page=page).run(Reporter())
    reproduction.reproduce_maps(*arguments)
    assert names & planned[1].keys() == {"town_04"}
    assert planned[1]["pages"] == {"town_01": "../pages/town_01.html"}
    # Nothing waits for a page.
    assert planned[1]["features of town_04"].needs == ()
    assert planned[1]["features of town_01"].needs == ()
    reproduction.reproduce_maps(*arguments, with_pages=False)
    assert names & planned[2].keys() == set()
    assert "town_04: already finished" in capsys.readouterr().err


def test_a_world_is_no_stage(tmp_path):
    folder = write_small_map(tmp_path / "town")
    world = {
        "world": "stage_04.sdf",
        "waypoints": "way.csv",
        "speeds": {
            "cruise": 6.0,
            "longitudinal_acceleration": 1.5,
            "lateral_acceleration": 2.0,
        },
    }
    (folder / "way.csv").write_text("x,y\n0,0\n9,0\n")
    (folder / "sequence_04.yaml").write_text(yaml.safe_dump(world))
    with pytest.raises(InputError, match=r"sequence_04.yaml: map: missing"):
        reproduction.reproduce_maps([str(folder)], tmp_path, Cluster())


COUNTING = """
import numpy as np
from evaluation import Method, MethodConfig, register

@register("counting")
class Counting(Method):
    Config = MethodConfig

    def describe(self, points):
        return len(points)

    def build_database(self, places):
        return np.array(places)

    def score(self, query, database, *, exhaustive=False):
        return -np.abs(database - query) / 1e6
"""


@pytest.mark.night
@pytest.mark.usefixtures("few_methods")
def test_quick_gives_the_same_tables(tmp_path, monkeypatch):
    """The tables include controls, and come from simulation alone."""
    # Other tests do not find the method registered.
    monkeypatch.setattr(registry, "_METHODS", dict(registry._METHODS))
    routes = {"01": "metropolis_04", "04": "metropolis_04"}
    town = write_town(tmp_path / "town", routes, 40)
    studies.run_here(monkeypatch, reproduction)
    cluster = Cluster()
    own = tmp_path / "counting.py"
    own.write_text(COUNTING)
    quick = reproduction.reproduce_maps(
        [str(town)],
        tmp_path / "quick",
        cluster,
        with_recordings=False,
        methods=["standard", str(own)],
        with_tables=True,
    )
    assert {path.name for path in (tmp_path / "quick").iterdir()} == {"report"}
    full = reproduction.reproduce_maps(
        [str(town)],
        tmp_path / "full",
        cluster,
        with_pages=False,
        methods=["standard", str(own)],
        with_tables=True,
    )
    assert (tmp_path / "full" / "town_01_stage_04" / "metadata.yaml").is_file()
    for name in (
        "place_recognition.csv",
        "poses.csv",
        "results.csv",
        "queries.csv",
        "query_details.csv",
        "query_details_unchanged.csv",
        "survival.csv",
        "tcr.csv",
    ):
        ours, theirs = (path.parent / name for path in (quick, full))
        assert ours.read_text() == theirs.read_text(), name
    rows = _rows(quick.parent / "place_recognition.csv")
    assert "counting" in {row["method"] for row in rows}
    rows = _rows(quick.parent / "query_details_unchanged.csv")
    # Both ways; the control takes the place of the earlier drive.
    both = {"town_01_stage_04", "town_04"}
    assert {row["match_drive"] for row in rows} == both


def test_quick_reads_existing_recordings(town, drives, planned, tmp_path):
    simulate(drives[0], tmp_path)
    reproduction.reproduce_maps(
        [str(town)], tmp_path, Cluster(), with_recordings=False
    )
    (jobs,) = planned
    recordings = jobs.pop("recordings")
    (control,) = control_drives(drives)
    assert recordings.keys() == {"town_01", "town_04", control.name}
    assert recordings["town_01"].made_by is None
    assert recordings["town_04"].made_by == SimulationSource(drives[1])
    assert recordings[control.name].made_by == SimulationSource(control)
    assert not recordings.keys() & jobs.keys()


def test_a_control_has_the_driver_of_its_drive(drives):
    def way(scenario):
        return plan_drive(scenario).positions([4.0, 8.0])

    wandering = [
        drive.replaced(driver=DriverConfig(wander=0.3)) for drive in drives
    ]
    (control,) = control_drives(wandering)
    np.testing.assert_array_equal(way(control), way(wandering[0]))
    assert np.abs(way(control) - way(drives[0])).max() > 0.02
    seeded = drives[0].replaced(driver=DriverConfig(wander=0.3, seed=3))
    (control,) = control_drives([seeded, wandering[1]])
    np.testing.assert_array_equal(way(control), way(seeded))


def _rows(path):
    with open(path, newline="") as stream:
        return list(csv.DictReader(stream))
