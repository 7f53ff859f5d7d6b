"""`cns-drake reproduce` remakes stale results, and nothing else."""

from collections import Counter

from helpers.internal import studies
from helpers.small_map import write_town
import pytest

from cns_drake.scenarios import provenance
from cns_drake.simulation import simulated_drive
from cns_drake.studies import reproduction
from cns_drake.studies.recording import Record
from evaluation.base import Cluster
from evaluation.base.jobs import store
from evaluation.methods import make_method
from evaluation.recognition import RANDOM_YAW_PROTOCOL
from evaluation.study import ChangeTask, recorded_city, run
from evaluation.study.tasks import place

pytestmark = [
    pytest.mark.slow,
    # One of two methods changes.
    pytest.mark.usefixtures("few_methods"),
]

DRIVES = {"town_01", "town_04", "town_01_stage_04"}
PAGES = {"town_01", "town_04"}
# Both ways, without the change and with it.
PAIRS = 4
ANSWERS = {"place": 2 * PAIRS, "search": 2 * PAIRS}
# Two drives are shown. Each drive is asked both as places and as queries.
DESCRIBED = {"descriptors": 2 * 2 * 3, "describingtime": 2 * 2 * 3}
READ = {"map": 3, "picture": 2, "scans": 2 * 3, **DESCRIBED}
CHANGES = {"change": PAIRS}
STUDY = {**READ, **ANSWERS, **CHANGES}


@pytest.fixture
def reproduce(tmp_path, monkeypatch):
    """Reproduces a town.

    Returns the kinds of new results, each with their number, and the names of
    the drives that were recorded, and of the pages that were written.
    """
    routes = {"01": "metropolis_04", "04": "metropolis_04"}
    town = write_town(tmp_path / "town", routes, 12)
    done = []

    def run_jobs(jobs, cluster, unit=""):
        done.extend(studies.do(jobs))

    for module in (run, recorded_city, reproduction):
        monkeypatch.setattr(module, "run_jobs", run_jobs)
    parts = tmp_path / "out" / "report" / "parts"

    def reproduced(**options):
        done.clear()
        before = {*parts.rglob("*.data")}
        reproduction.reproduce_maps(
            [str(town)],
            tmp_path / "out",
            Cluster(),
            {"random-yaw": RANDOM_YAW_PROTOCOL},
            **options,
        )
        new = {*parts.rglob("*.data")} - before
        kinds = Counter(path.parent.name for path in new)
        for of_pictures in ("changes", "pages"):
            del kinds[of_pictures]
        return kinds, {*done} & DRIVES

    return reproduced


def change_stage(file):
    text = file.read_text()
    assert "</world>" in text
    file.write_text(text.replace("</world>", "<!-- Changed. --></world>"))


@pytest.mark.night
def test_a_quick_study(reproduce, monkeypatch, tmp_path):
    def again(**options):
        kinds, recorded = reproduce(with_recordings=False, **options)
        assert not recorded
        return kinds

    assert again() == STUDY
    assert again() == {}
    # What a raised version counts for is made again, and nothing else.
    solid = type(make_method("solid", {}))
    monkeypatch.setattr(solid, "version", 2)
    of_method = {
        kind: number // 2 for kind, number in {**DESCRIBED, **ANSWERS}.items()
    }
    assert again() == of_method
    monkeypatch.setattr(ChangeTask, "version", 2)
    assert again() == CHANGES
    monkeypatch.setattr(place, "ANSWERS_VERSION", 2)
    assert again() == ANSWERS
    monkeypatch.setattr(simulated_drive, "SIMULATION_VERSION", 0)
    assert again() == STUDY
    monkeypatch.setattr(store, "__version__", "another")
    assert again() == STUDY
    # Results of one method on all drives.
    settings = ["solid.sensor_height=1.7"]
    assert again(settings=settings) == of_method
    assert again(settings=settings) == {}
    # Results of each setting stay.
    assert again() == {}
    # One drive, and all comparisons with it.
    change_stage(tmp_path / "town" / "stage_01.sdf")
    assert again() == {
        "map": 1,
        "picture": 1,
        "scans": 2,
        "descriptors": 4,
        "describingtime": 4,
        "place": 4,
        "search": 4,
        "change": 2,
    }


@pytest.mark.night
def test_recordings_pages_and_pictures(reproduce, monkeypatch, tmp_path):
    assert reproduce() == (STUDY, DRIVES)
    assert reproduce() == ({}, set())
    # The page is made again, the recording is not.
    monkeypatch.setattr(Record, "version", 2)
    assert reproduce() == ({}, PAGES)
    assert not list((tmp_path / "out").glob("*.part"))
    monkeypatch.setattr(provenance, "SIMULATION_VERSION", 0)
    # The new recordings hold the same, and so what was measured on them stays.
    assert reproduce(with_pages=False) == ({}, DRIVES)
    assert reproduce() == ({}, PAGES)
    # A page also shows the last stage.
    change_stage(tmp_path / "town" / "stage_04.sdf")
    drives = {"town_04", "town_01_stage_04"}
    assert reproduce(with_pages=False)[1] == drives
    assert reproduce() == ({}, PAGES)
