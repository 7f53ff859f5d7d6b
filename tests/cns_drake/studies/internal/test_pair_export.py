"""Sets for other trainers: pickles, clouds, exact overlaps."""

import pickle
import sys
import types

from helpers.internal import studies
from helpers.internal.eval_program import run_program
from helpers.tiny_drive import tiny_scenario, write_scenario
import numpy as np
import pytest

from cns_drake.__main__ import main
from cns_drake.base import InputError
from cns_drake.studies import ExportOptions, export_pairs, pair_export
from cns_drake.studies.pair_export import (
    ExportedDrive,
    evaluation_sets,
    training_tuples,
    write_pickles,
)


def run_of(seed, number, city=0):
    X_WS = np.tile(np.eye(4), (number, 1, 1))
    X_WS[:, :2, 3] = np.random.default_rng(seed).uniform(0, 150, (number, 2))
    return ExportedDrive(f"runs/{seed}", X_WS, city)


def test_positives_and_non_negatives_by_distances():
    runs = [run_of(1, 40), run_of(2, 30), run_of(1, 40, city=1)]
    found = training_tuples(runs)
    xy = np.concatenate([run.X_WS[:, :2, 3] for run in runs])
    city = np.repeat([0, 0, 1], [40, 30, 40])
    for number, one in found.items():
        distance = np.linalg.norm(xy - xy[number], axis=1)
        same = city == city[number]
        near = set(np.flatnonzero(same & (distance <= 10.0))) - {number}
        assert one.positives.tolist() == sorted(near)
        wide = np.flatnonzero(same & (distance <= 50.0))
        assert one.non_negatives.tolist() == wide.tolist()
        assert one.id == number
        # Northing is y; the other city lies elsewhere.
        shift = 100_000.0 * city[number]
        assert one.position.tolist() == [xy[number, 1] + shift, xy[number, 0]]


def test_matches_of_the_evaluation_by_distances():
    runs = [run_of(1, 20), run_of(2, 30)]
    database, queries = evaluation_sets(runs)
    assert [len(one) for one in database] == [20, 30]
    assert database[1][4]["query"] == "runs/2/000004.bin"
    assert 1 not in queries[1][0]
    for number in range(30):
        distance = np.linalg.norm(
            runs[0].X_WS[:, :2, 3] - runs[1].X_WS[number, :2, 3], axis=1
        )
        matches = np.flatnonzero(distance <= 25.0).tolist()
        assert queries[1][number][0] == matches


def test_a_trainer_unpickles_its_own_class(monkeypatch):
    """As MinkLoc3Dv2: its module has the class with a constructor."""

    class TrainingTuple:
        def __init__(self, id, timestamp):
            raise AssertionError("unpickling does not call it")

    data = pickle.dumps(training_tuples([run_of(1, 5)]))
    module = types.ModuleType("datasets.base_datasets")
    module.TrainingTuple = TrainingTuple
    monkeypatch.setitem(sys.modules, "datasets.base_datasets", module)
    found = pickle.loads(data)
    assert type(found[3]) is TrainingTuple
    assert found[3].rel_scan_filepath == "runs/1/000003.bin"
    assert found[3].positives.ndim == 1


@pytest.fixture
def in_this_process(monkeypatch):
    def run(jobs, cluster):
        studies.do(jobs)

    monkeypatch.setattr(pair_export, "run_jobs", run)


def drives(folder, lidar=None):
    lidar = lidar or {"preset": "vlp-16", "columns": 360}
    return [
        tiny_scenario(
            folder, name=name, lidars={"lidar": lidar}, frames=30, seed=seed
        )
        for seed, name in enumerate(("one", "two"))
    ]


def test_clouds_of_pointnetvlad(tmp_path, in_this_process):
    options = ExportOptions(spacing=1.0, scans=3)
    both = drives(tmp_path)
    output = tmp_path / "set"
    paths = export_pairs(both[:1], both[1:], output, options, None)
    assert [path.name for path in paths] == [
        "training_queries_baseline2.pickle",
        "test_queries_baseline2.pickle",
        "evaluation_database.pickle",
        "evaluation_query.pickle",
    ]
    learned = pickle.loads(paths[0].read_bytes())
    assert {
        one.rel_scan_filepath.split("/")[1] for one in learned.values()
    } == {"one"}
    for one in learned.values():
        cloud = np.fromfile(output / one.rel_scan_filepath).reshape(-1, 3)
        assert cloud.shape == (4096, 3)
        assert np.abs(cloud).max() <= 1.0
        assert cloud.mean(axis=0) == pytest.approx(0.0, abs=1e-9)
    # The hall is 10 m high and the ground is left out, by factor 100.
    assert 0.03 < np.ptp(cloud[:, 2]) <= 0.1


@pytest.mark.slow
def test_clouds_of_a_lidar_of_ones_own(tmp_path, in_this_process):
    """All rings look down, by 30 deg at most: nothing is near or far."""
    sheet = tmp_path / "unit.yaml"
    sheet.write_text(
        "rings_deg: [[-10.0, -30.0, 5]]\ncolumns: 360\n"
        "ranges: [0.5, 60.0]\nsource: mine\n"
    )
    options = ExportOptions("overlap", spacing=1.0)
    both = drives(tmp_path, {"unit": str(sheet)})
    export_pairs(both, [], tmp_path / "set", options, None)
    scans = sorted((tmp_path / "set/runs/one").rglob("*.bin"))
    points = np.fromfile(scans[0], np.float32).reshape(-1, 4)
    x, y, z = points.T[:3]
    elevation = np.degrees(np.arctan2(z, np.hypot(x, y)))
    off = np.abs(elevation[:, None] - [-10, -15, -20, -25, -30]).min(axis=1)
    assert len(points) > 100
    assert off.max() < 0.05


def test_exact_overlaps_of_a_drive_with_itself(tmp_path, in_this_process):
    options = ExportOptions("overlap", spacing=1.0)
    (path,) = export_pairs(
        drives(tmp_path), [], tmp_path / "set", options, None
    )
    with np.load(path) as file:
        overlaps, seq = file["overlaps"], file["seq"]
    assert set(map(tuple, seq)) == {("one", "two"), ("two", "one")}
    number = (tmp_path / "set/runs/one/poses.txt").read_text().count("\n")
    same = overlaps[overlaps[:, 0] == overlaps[:, 1]]
    assert len(same) == 2 * number
    assert same[:, 2] == pytest.approx(1.0, abs=1e-9)
    assert same[:, 3] == pytest.approx(0.0, abs=1e-9)
    scan = np.fromfile(tmp_path / "set/runs/one/000000.bin", "<f4")
    assert len(scan) % 4 == 0
    assert len(scan) > 0


def test_two_drives_of_one_name_are_refused(tmp_path):
    both = [tiny_scenario(tmp_path)] * 2
    with pytest.raises(InputError, match="two drives are named tiny_01"):
        export_pairs(both, [], tmp_path / "set", ExportOptions(), None)


def test_submaps_have_no_overlaps(tmp_path, capsys):
    file = write_scenario(tiny_scenario(tmp_path), tmp_path)
    line = f"export {file} --format overlap --scans 2 --output x"
    status, _, err = run_program(capsys, "cns-drake", main, *line.split())
    assert status == 2
    assert "--scans: not with --format overlap; only with pointnetvlad" in err


def test_clouds_without_positives_are_counted(tmp_path):
    runs = [run_of(1, 12), run_of(2, 12)]
    found = training_tuples(runs)
    alone = sum(len(one.positives) == 0 for one in found.values())
    assert 0 < alone < len(found) == 24
    notes = []
    write_pickles(tmp_path, runs, runs, notes.append)
    assert f"training: {alone} of 24 clouds have no other" in notes[0]


def line(name, number, city=0, start=0.0):
    X_WS = np.tile(np.eye(4), (number, 1, 1))
    X_WS[:, 0, 3] = start + 10.0 * np.arange(number)
    return ExportedDrive(f"runs/{name}", X_WS, city)


@pytest.mark.parametrize(
    ("tested", "note"),
    [
        ([line("a", 30)], "a is the only drive of its city"),
        ([line("a", 30), line("b", 24)], "b has 24 clouds"),
        (
            [line("a", 30), line("b", 30, start=290.0 + 25.1)],
            "a and b are never within 25 m",
        ),
        ([line("a", 25), line("b", 25, start=240.0 + 25.0)], None),
    ],
)
def test_cities_that_cannot_be_evaluated(tmp_path, tested, note):
    notes = []
    write_pickles(tmp_path, tested, tested, notes.append)
    written = (tmp_path / "oxford_evaluation_query.pickle").exists()
    assert written == (note is None)
    assert (note is None) or note in notes[-1]


def test_evaluation_files_have_the_names_of_minkloc(tmp_path):
    cities = [[line(f"{n}_{k}", 30, n) for k in range(2)] for n in range(5)]
    names = ("oxford", "university", "residential", "business")
    for number, shown in (
        (1, [0, 0, 0, 0]),
        (3, [0, 1, 2, 0]),
        (5, [*range(4)]),
    ):
        tested = [run for city in cities[:number] for run in city]
        notes = []
        write_pickles(tmp_path, tested, tested, notes.append)
        assert len(notes) == (number == 5)
        for name, city in zip(names, shown, strict=True):
            database, queries = (
                pickle.loads(
                    (tmp_path / f"{name}_evaluation_{one}.pickle").read_bytes()
                )
                for one in ("database", "query")
            )
            # What the evaluation does: each pair of drives has a match.
            assert database[0][0]["query"] == f"runs/{city}_0/000000.bin"
            assert len(database) == len(queries) == 2
            assert any(queries[1][k][0] for k in range(30))
            assert any(queries[0][k][1] for k in range(30))


def test_a_set_without_drives_to_learn_from(tmp_path):
    with pytest.raises(InputError, match="no drive to learn from"):
        export_pairs([], [tiny_scenario(tmp_path)], tmp_path, None, None)


def test_a_held_out_drive_may_be_named_with_the_others(
    tmp_path, monkeypatch, capsys
):
    seen = {}

    def take(learned, tested, *rest):
        seen["names"] = [
            [one.name for one in part] for part in (learned, tested)
        ]
        return []

    monkeypatch.setattr(pair_export, "export_pairs", take)
    line = (
        "export riverside_01 riverside_02 --held-out"
        f" riverside_02 --format pointnetvlad --output {tmp_path}"
    )
    status, *_ = run_program(capsys, "cns-drake", main, *line.split())
    assert not status
    assert seen["names"] == [["riverside_01"], ["riverside_02"]]
