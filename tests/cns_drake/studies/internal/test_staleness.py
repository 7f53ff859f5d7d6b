"""`cns-drake reproduce` remakes stale results, and nothing else."""

import re
import shutil

from helpers.documents import ROOT
from helpers.internal import studies
from helpers.small_map import write_town
import pytest

from cns_drake.base import Cluster
from cns_drake.base.jobs import fingerprint
from cns_drake.studies import reproduction
from evaluation.recognition import RANDOM_YAW_PROTOCOL
from evaluation.study import engine

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
def code(tmp_path, monkeypatch):
    """A copy of the code, in place of the running code."""
    for name in ("cns_drake", "evaluation"):
        shutil.copytree(
            ROOT / name,
            tmp_path / "code" / name,
            ignore=shutil.ignore_patterns("__pycache__"),
        )
    monkeypatch.setattr(fingerprint, "_ROOT", tmp_path / "code")
    fingerprint.code_digest.cache_clear()
    yield tmp_path / "code"
    fingerprint.code_digest.cache_clear()


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

    monkeypatch.setattr(engine, "run_jobs", run_jobs)

    def run(**options):
        reproduction.reproduce_maps(
            [str(town)],
            tmp_path / "out",
            Cluster(),
            {"random-yaw": RANDOM_YAW_PROTOCOL},
            **options,
        )
        return done[-1]

    return run


def change(file, old, new):
    fingerprint.code_digest.cache_clear()
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


@pytest.mark.night
def test_a_quick_study(reproduce, code, tmp_path):
    assert reproduce(with_recordings=False) == STUDY
    assert reproduce(with_recordings=False) == set()
    # The code of the report's page measures nothing.
    change(code / "evaluation/results/page_template/frame.css", "{", "{ ")
    assert reproduce(with_recordings=False) == set()
    change(code / "cns_drake/units/sheets/cns.yaml", "120.0", "10.0")
    assert reproduce(with_recordings=False) == STUDY
    change(
        code / "evaluation/results/sections/change_pictures.py", "def ", "def  "
    )
    assert reproduce(with_recordings=False) == DRAWN
    # Results of one method on all drives, and its part of their features.
    options = {
        "with_recordings": False,
        "settings": ["solid.sensor_height=1.7"],
    }
    assert reproduce(**options) == FEATURES | COMPARED | CONTROL
    assert reproduce(**options) == set()
    # Results of each setting stay.
    assert reproduce(with_recordings=False) == set()
    # One drive, and all comparisons with it, which need descriptions of both.
    stage = tmp_path / "town" / "stage_01.sdf"
    change(stage, "</world>", "<!-- Changed. --></world>")
    features = {"features of town_01", "features of town_04"}
    maps = {"change town_01,town_04", "change town_04,town_01"}
    pairs = COMPARED | maps
    assert reproduce(with_recordings=False) == features | DRAWN | pairs


@pytest.mark.night
def test_recordings_pages_and_pictures(reproduce, code, tmp_path):
    everything = DRIVES | STUDY | PICTURES
    assert reproduce() == everything
    assert reproduce() == set()
    # The page is made again, the recording is not.
    change(code / "cns_drake/pictures/page_template/drive.css", "{", "{ ")
    assert reproduce() == PAGES
    assert not list((tmp_path / "out").glob("*.part"))
    change(code / "cns_drake/units/sheets/cns.yaml", "120.0", "10.0")
    # The code that runs is not the copy: the new recordings hold the same, and
    # so what was measured on them stays.
    assert reproduce(with_pages=False) == DRIVES | FEATURES | PICTURES
    assert reproduce() == PAGES
    # A page also shows the last stage.
    stage = tmp_path / "town" / "stage_04.sdf"
    change(stage, "</world>", "<!-- Changed. --></world>")
    drives = {"town_04", "town_01_stage_04"}
    assert reproduce(with_pages=False) & DRIVES == drives
    assert reproduce() == PAGES
