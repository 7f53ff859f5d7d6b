"""`cns-drake reproduce` remakes stale results, and nothing else."""

import re

from helpers.internal import studies
from helpers.small_map import write_town
import pytest

from cns_drake.scenarios import provenance
from cns_drake.simulation import simulated_drive
from cns_drake.studies import reproduction
from cns_drake.studies.recording import Record
from evaluation.base import Cluster
from evaluation.base.jobs import step
from evaluation.methods import make_method
from evaluation.recognition import RANDOM_YAW_PROTOCOL
from evaluation.study import ChangeTask, PlaceTask, study

pytestmark = [
    pytest.mark.slow,
    # One of two methods changes.
    pytest.mark.usefixtures("few_methods"),
]

DRIVES = {"town_01", "town_04", "town_01_stage_04"}
PAGES = {"town_01", "town_04"}
FEATURES = {f"features of {name}" for name in DRIVES}
DRAWN = {"draw town", "draw town 01 > 04"}
COMPARED = {"place town_01 town_04", "place town_04 town_01"}
CONTROL = {
    "place town_01_stage_04 town_04", "place town_04 town_01_stage_04"
}  # fmt: skip
MEASURED = {
    "change town_01,town_04", "change town_04,town_01",
    "change town_01_stage_04,town_04", "change town_04,town_01_stage_04",
}  # fmt: skip
STUDY = FEATURES | DRAWN | COMPARED | CONTROL | MEASURED
PICTURES = {"picture town drives"}


@pytest.fixture
def reproduce(tmp_path, monkeypatch):
    """Reproduces a town; returns the names of the jobs that ran."""
    routes = {"01": "metropolis_04", "04": "metropolis_04"}
    town = write_town(tmp_path / "town", routes, 12)
    done = []

    def run_jobs(jobs, cluster, unit=""):
        # A name may end with a digest of what a task is asked.
        names = [re.sub(r" [0-9a-f]{8}$", "", one) for one in studies.do(jobs)]
        assert len(names) == len(set(names))
        done.append(set(names))

    monkeypatch.setattr(study, "run_jobs", run_jobs)

    def run(**options):
        done.clear()
        reproduction.reproduce_maps(
            [str(town)],
            tmp_path / "out",
            Cluster(),
            {"random-yaw": RANDOM_YAW_PROTOCOL},
            **options,
        )
        # Pictures are drawn when the tables are written.
        return set().union(*done)

    return run


def change_stage(file):
    text = file.read_text()
    assert "</world>" in text
    file.write_text(text.replace("</world>", "<!-- Changed. --></world>"))


@pytest.mark.night
def test_a_quick_study(reproduce, monkeypatch, tmp_path):
    assert reproduce(with_recordings=False) == STUDY
    assert reproduce(with_recordings=False) == set()
    # What a raised version counts for is made again, and nothing else.
    solid = type(make_method("solid", {}))
    monkeypatch.setattr(solid, "version", 2)
    of_method = FEATURES | COMPARED | CONTROL
    assert reproduce(with_recordings=False) == of_method
    monkeypatch.setattr(ChangeTask, "version", 2)
    of_change = MEASURED | {"draw town 01 > 04"}
    assert reproduce(with_recordings=False) == of_change
    monkeypatch.setattr(PlaceTask, "version", 2)
    assert reproduce(with_recordings=False) == COMPARED | CONTROL
    monkeypatch.setattr(simulated_drive, "SIMULATION_VERSION", 0)
    assert reproduce(with_recordings=False) == STUDY
    monkeypatch.setattr(step, "__version__", "another")
    assert reproduce(with_recordings=False) == STUDY
    # Results of one method on all drives, and its part of their features.
    options = {
        "with_recordings": False,
        "settings": ["solid.sensor_height=1.7"],
    }
    assert reproduce(**options) == of_method
    assert reproduce(**options) == set()
    # Results of each setting stay.
    assert reproduce(with_recordings=False) == set()
    # One drive, and all comparisons with it.
    change_stage(tmp_path / "town" / "stage_01.sdf")
    features = {"features of town_01"}
    maps = {"change town_01,town_04", "change town_04,town_01"}
    pairs = COMPARED | maps
    assert reproduce(with_recordings=False) == features | DRAWN | pairs


@pytest.mark.night
def test_recordings_pages_and_pictures(reproduce, monkeypatch, tmp_path):
    everything = DRIVES | STUDY | PICTURES
    assert reproduce() == everything
    assert reproduce() == set()
    # The page is made again, the recording is not.
    monkeypatch.setattr(Record, "version", 2)
    assert reproduce() == PAGES
    assert not list((tmp_path / "out").glob("*.part"))
    monkeypatch.setattr(provenance, "SIMULATION_VERSION", 0)
    # The new recordings hold the same, and so what was measured on them stays.
    assert reproduce(with_pages=False) == DRIVES
    assert reproduce() == PAGES
    # A page also shows the last stage.
    change_stage(tmp_path / "town" / "stage_04.sdf")
    drives = {"town_04", "town_01_stage_04"}
    assert reproduce(with_pages=False) & DRIVES == drives
    assert reproduce() == PAGES
