"""Maps that an experiment makes: what is made, once, of which file."""

import contextlib
from dataclasses import dataclass
from functools import partial
import os

from helpers.internal import studies
from helpers.small_city import write_small_city
import pytest

from cns_drake.scenarios import AgeCity, MakeMap, map_step
from cns_drake.studies.maps.made_maps import made_map_step
from evaluation.base import InputError, Reporter, draft_folder
from evaluation.study import Experiment, MadeMap
from worlds.ageing import DEFAULT_RATES
from worlds.city import generate_city
from worlds.maps import MapFolder

DRIVE = """
map: .
stage: "02"
route:
  - {road: north, direction: forward, lane: 1, start: 10.0, end: 120.0}
speeds: {cruise: 8.0}
"""


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    folder = write_small_city(tmp_path_factory.mktemp("made") / "town")
    generate_city(folder)
    (folder / "sequence_02.yaml").write_text(DRIVE)
    return folder


@pytest.mark.slow
@pytest.mark.night
def test_an_older_city_is_made_once_and_anew_when_its_inputs_change(
    town, tmp_path, monkeypatch
):
    studies.run_here(monkeypatch, map_step)
    rates = tuple(sorted(DEFAULT_RATES.items()))
    step = AgeCity(tmp_path / "old", town, (2,), 1, rates)
    assert not step.is_done()
    step.run(Reporter())
    assert step.is_done()
    assert list(MapFolder(step.folder).stages()) == ["01", "02"]
    other = AgeCity(step.folder, town, (3,), 1, rates)
    assert not other.is_done()
    other.run(Reporter())
    assert other.is_done()
    assert not step.is_done()
    stages = town / "stages.yaml"
    text = stages.read_bytes()
    try:
        stages.write_bytes(text + b"# Another comment.\n")
        assert not other.is_done()
    finally:
        stages.write_bytes(text)
    assert other.is_done()


class Killed(BaseException):
    """What ends a killed process."""


@dataclass(frozen=True)
class MakeFiles(MakeMap):
    """Makes a map of three files, which hold its version."""

    version: int

    def make(self, finish, reporter):
        with draft_folder(self.folder) as draft:
            for name in ("city.yaml", "roads.yaml", "stage_01.sdf"):
                (draft / name).write_text(str(self.version))
            finish(draft)

    def sources(self):
        return {"version": self.version}

    def is_whole(self):
        texts = [path.read_text() for path in self.folder.glob("*.[ys]*")]
        return texts == [str(self.version)] * 3


def act_or_die(left, act, *args, **options):
    """Acts as often as is left; a dead process does not even clean up."""
    left[0] -= 1
    if left[0] < 0:
        raise Killed
    return act(*args, **options)


def test_a_killed_study_leaves_no_half_of_a_map(tmp_path, monkeypatch):
    old, new = (MakeFiles(tmp_path / "map", version) for version in (1, 2))
    survived = False
    moment = 0
    while not survived:
        if not old.is_done():
            old.run(Reporter())
        left = [moment]
        with monkeypatch.context() as patched:
            for name in ("mkdir", "open", "replace", "rmdir", "unlink"):
                act = getattr(os, name)
                patched.setattr(os, name, partial(act_or_die, left, act))
            with contextlib.suppress(Killed):
                new.run(Reporter())
                survived = True
        there = new.folder.exists()
        assert not there or (old.is_done() and old.is_whole()) or new.is_done()
        # The same command goes on, and so does the one before.
        for step in (new, old):
            if not step.is_done():
                step.run(Reporter())
            assert step.is_done()
            assert step.is_whole()
        moment += 1
    assert moment > 10


def made(**fields):
    return MadeMap.model_validate({"name": "delft", "seed": 3, **fields})


def test_a_source_with_stages_of_its_own_does_not_grow(tmp_path):
    (tmp_path / "a.xodr").write_text("<OpenDRIVE/>")
    made = MadeMap(name="a", **{"import": "a.xodr"}, seed=1, grow=0.3)
    experiment = Experiment(name="x", maps=[made], files=str(tmp_path))
    with pytest.raises(InputError, match=r"a\.grow: a map from OpenDRIVE"):
        made_map_step(made, experiment, tmp_path / "a", {})
