"""`cns-drake reproduce`: one graph of jobs from recordings to pictures."""

from helpers.internal import studies
from helpers.small_map import write_small_map, write_town
import numpy as np
import pytest
import yaml

from cns_drake.base import Cluster, InputError, Reporter
from cns_drake.scenarios import DriverConfig, load_scenario, plan_drive
from cns_drake.simulation import SimulationSource, simulate
from cns_drake.studies import reproduction
from cns_drake.studies.recording import Record
from cns_drake.studies.reproduction import (
    control_drives,
    recording_info,
)
from evaluation.recognition import RANDOM_YAW_PROTOCOL
from evaluation.results import QueryRows, Results
from evaluation.study import drives_by_map, engine, find_recordings

pytestmark = pytest.mark.slow
RANDOM_YAW = {"random-yaw": RANDOM_YAW_PROTOCOL}


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
    """The arguments of studies; none of them is measured."""
    runs = []

    def measure(recordings, output, cluster, methods, protocols, **more):
        assert callable(more["on_note"])
        assert (list(protocols), more["with_costs"]) == (["random-yaw"], False)
        runs.append({"recordings": {one.name: one for one in recordings}})
        runs[-1]["pages"] = more["pages"]
        runs[-1]["jobs"] = {job.name: job for job in more["further_jobs"]}
        return output / "index.html"

    monkeypatch.setattr(reproduction, "study_recordings", measure)
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
    arguments = ([str(town)], tmp_path, Cluster(3), RANDOM_YAW)
    path = reproduction.reproduce_maps(*arguments)
    assert path == tmp_path / "report" / "index.html"
    (run,) = planned
    names = {"town_01", "town_04", "town_01_stage_04"}
    assert run["recordings"].keys() == names
    assert run["pages"] == {
        "town_01": "../pages/town_01.html",
        "town_04": "../pages/town_04.html",
    }
    jobs = run["jobs"]
    for name in names:
        assert jobs[name].needs == ()
        assert run["recordings"][name].needs == (name,)
    assert "picture town drives" in jobs
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
    assert names & planned[1]["jobs"].keys() == {"town_04"}
    # Nothing waits for a page.
    assert {one.needs for one in planned[1]["recordings"].values()} == {()}
    reproduction.reproduce_maps(*arguments, with_pages=False)
    assert names & planned[2]["jobs"].keys() == set()
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
        reproduction.reproduce_maps(
            [str(folder)], tmp_path, Cluster(), RANDOM_YAW
        )


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
def test_quick_gives_the_same_tables(tmp_path, monkeypatch, own_methods):
    """The tables include controls, and come from simulation alone."""
    routes = {"01": "metropolis_04", "04": "metropolis_04"}
    town = write_town(tmp_path / "town", routes, 40)
    studies.run_here(monkeypatch, engine)
    cluster = Cluster()
    own = tmp_path / "counting.py"
    own.write_text(COUNTING)
    quick = reproduction.reproduce_maps(
        [str(town)],
        tmp_path / "quick",
        cluster,
        RANDOM_YAW,
        with_recordings=False,
        methods=["standard", str(own)],
    )
    assert {path.name for path in (tmp_path / "quick").iterdir()} == {"report"}
    full = reproduction.reproduce_maps(
        [str(town)],
        tmp_path / "full",
        cluster,
        RANDOM_YAW,
        with_pages=False,
        methods=["standard", str(own)],
    )
    assert (tmp_path / "full" / "town_01_stage_04" / "metadata.yaml").is_file()
    for name in ("results.csv", "queries.csv"):
        ours, theirs = (path.parent / name for path in (quick, full))
        assert ours.read_text() == theirs.read_text(), name
    assert "counting" in Results.read(quick.parent).distinct("method")
    # Both ways; the control takes the place of the earlier drive.
    matched = {
        drive
        for one in QueryRows.read(quick.parent).answers
        if one["both.stage"] == "last"
        for drive in one.columns["match_drive"]
    }
    assert matched == {"town_01_stage_04", "town_04"}


def test_quick_reads_existing_recordings(town, drives, planned, tmp_path):
    simulate(drives[0], tmp_path)
    reproduction.reproduce_maps(
        [str(town)], tmp_path, Cluster(), RANDOM_YAW, with_recordings=False
    )
    (run,) = planned
    recordings, jobs = run["recordings"], run["jobs"]
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
