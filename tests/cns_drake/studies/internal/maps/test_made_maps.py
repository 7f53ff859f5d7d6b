"""Maps that an experiment makes: what is made, once, of which file."""

import contextlib
from dataclasses import dataclass
from functools import partial
import hashlib
import os

from helpers.internal import studies
from helpers.small_city import write_small_city
import pytest

from cns_drake.ageing import DEFAULT_RATES
from cns_drake.base import Cluster, InputError, Reporter, draft_folder
from cns_drake.city import generate_city
from cns_drake.scenarios import load_scenario, shipped_cities
from cns_drake.scene import MapFolder
from cns_drake.studies import Experiment, MadeMap, load_experiment
from cns_drake.studies.maps import map_step
from cns_drake.studies.maps.made_maps import AgeCity, MadeMaps, made_map_step
from cns_drake.studies.maps.map_step import MakeMap
from cns_drake.studies.maps.redrawing import RedrawCity

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


@pytest.fixture
def steps(monkeypatch):
    """The steps of the jobs of each run, which are not done."""
    runs = []
    monkeypatch.setattr(
        map_step,
        "run_jobs",
        lambda jobs, cluster, unit="": runs.append([job.step for job in jobs]),
    )
    return runs


def test_a_city_ages_once_for_all_of_its_years(town, tmp_path, steps):
    drive = load_scenario(town / "sequence_02.yaml")
    made = MadeMaps(tmp_path)
    for years, rates, seed in (
        (20, 1.0, 1),
        (5, 1.0, 1),
        (20, 1.0, 1),
        (5, 1.0, 2),
        (5, 2.0, 1),
        (5, {"factor": 2}, 1),
        (5, {"felled": 0.5}, 1),
    ):
        # It is where it was, as long as nothing is made.
        here = made.aged(drive, years, rates, seed)
        assert here == (drive.map, drive.stage)
    made.make(Cluster())
    (run,) = steps
    assert all(isinstance(one, AgeCity) for one in run)
    doubled = {name: 2 * rate for name, rate in DEFAULT_RATES.items()}
    doubled["moved"] = DEFAULT_RATES["moved"]  # A length.
    found = {
        (one.years, one.seed, tuple(sorted(dict(one.rates).items())))
        for one in run
    }
    assert found == {
        (years, seed, tuple(sorted(rates.items())))
        for years, seed, rates in (
            ((5, 20), 1, DEFAULT_RATES),
            ((5,), 2, DEFAULT_RATES),
            ((5,), 1, doubled),
            ((5,), 1, {**DEFAULT_RATES, "felled": 0.5}),
        )
    }
    folders = [one.folder for one in run]
    assert len(set(folders)) == len(folders) == 4
    assert {one.source for one in run} == {town.resolve()}
    # Stage 01 is today, and each of the years is one more.
    for years, stage in ((5, "02"), (20, "03")):
        folder, found = made.aged(drive, years, 1.0, 1)
        assert found == stage
        assert folder == str(tmp_path / "town_s1")


def test_a_city_is_drawn_anew_for_each_version(town, tmp_path, steps):
    drive = load_scenario(town / "sequence_02.yaml")
    made = MadeMaps(tmp_path)
    for version in (7, 0, 7):
        here = made.redrawn(drive, version)
        assert here == (drive.map, drive.stage)
    made.make(Cluster())
    folders = [tmp_path / "town_c7", tmp_path / "town_c0"]
    assert steps == [
        [
            RedrawCity(folder, town.resolve(), "01", seed)
            for seed, folder in zip((7, 0), folders, strict=True)
        ]
    ]
    assert made.redrawn(drive, 7) == (str(folders[0]), "01")


@pytest.mark.parametrize(
    ("years", "rates", "fault"),
    [
        (0, 1.0, "years: 0 is not from 1 to 200"),
        (201, 1.0, "years: 201 is not from 1 to 200"),
        (-1, 1.0, "years: -1 is not"),
        (2.5, 1.0, "years: 2.5 is not"),
        (True, 1.0, "years: True is not"),
        (5, "fast", "rates: 'fast' is no number"),
        (5, True, "rates: True is no number"),
        (5, -1, "rates: -1 times"),
        (5, {"war": 0.1}, "rates: war: unknown event"),
        (5, {"felled": 2}, "rates: felled: "),
        (5, {"factor": "x"}, "rates: 'x' is no number"),
    ],
)
def test_years_that_cannot_be(town, tmp_path, years, rates, fault):
    drive = load_scenario(town / "sequence_02.yaml")
    with pytest.raises(InputError, match=f"^{fault}"):
        MadeMaps(tmp_path).aged(drive, years, rates, 1)


@pytest.mark.parametrize("version", [-1, 2**31, 1.5, True, "one", None])
def test_versions_that_cannot_be(town, tmp_path, version):
    drive = load_scenario(town / "sequence_02.yaml")
    with pytest.raises(
        InputError, match=r"^redraw: .* is no whole number from 0"
    ):
        MadeMaps(tmp_path).redrawn(drive, version)


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


def test_no_folder_of_others_is_replaced(town, tmp_path):
    mine = tmp_path / "old"
    mine.mkdir()
    (mine / "notes.txt").write_text("mine")
    rates = tuple(sorted(DEFAULT_RATES.items()))
    with pytest.raises(InputError, match="old: "):
        AgeCity(mine, town, (2,), 1, rates).run(Reporter())
    assert [path.name for path in mine.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("plain", [False, True])
def test_an_import_is_dressed_as_on_the_command_line(tmp_path, plain):
    (tmp_path / "city.json").write_text("{}")
    wanted = Experiment.model_validate(
        {
            "name": "mine",
            "files": str(tmp_path),
            "maps": [
                {"name": "a", "import": "city.json", "seed": 1}
                | ({"plain": True} if plain else {})
            ],
        }
    )
    step = made_map_step(wanted.maps[0], wanted, tmp_path / "a", {})
    assert step.options.dressed is not plain


def test_twelve_pairs_are_frozen():
    pairs = load_experiment("map-pairs").maps
    assert len({one.name for one in pairs}) == len(pairs) == 12
    imported = [one for one in pairs if one.import_file is not None]
    assert len(imported) == 4
    assert all(len(one.sha256) == 64 for one in imported)
    assert all(one.plain for one in imported)
    assert {one.age for one in pairs if one.years} == set(shipped_cities())
    assert {one.years for one in pairs} == {None, 5, 20}
    assert len({one.seed for one in pairs}) == 12


def made(**fields):
    return MadeMap.model_validate({"name": "delft", "seed": 3, **fields})


def test_other_files_are_refused(tmp_path):
    content = b"{}"
    digest = hashlib.sha256(content).hexdigest()
    wanted = made(**{"import": "delft.json", "sha256": digest})
    experiment = Experiment(name="mine", files=str(tmp_path))
    arguments = wanted, experiment, tmp_path / "city", {}
    with pytest.raises(InputError, match=r"delft\.json: no such.*--set files="):
        made_map_step(*arguments)
    (tmp_path / "delft.json").write_bytes(content + b" ")
    with pytest.raises(InputError, match=r"json: not the file of delft: its"):
        made_map_step(*arguments)
    (tmp_path / "delft.json").write_bytes(content)
    step = made_map_step(*arguments)
    assert step.source == tmp_path / "delft.json"
    assert (step.options.seed, step.folder) == (3, tmp_path / "city")


def test_a_city_to_age_is_a_map(town, tmp_path):
    experiment = Experiment(name="mine")
    for source, folder in ((str(town), town), ("short", town)):
        step = made_map_step(
            made(age=source, years=4),
            experiment,
            tmp_path / "city",
            {"short": town},
        )
        assert (step.source, step.years, step.seed) == (folder, (4,), 3)
    with pytest.raises(InputError, match="maps: delft: no map 'atlantis' with"):
        made_map_step(
            made(age="atlantis", years=4), experiment, tmp_path / "city", {}
        )
