"""Sets for other trainers: pickles, clouds, exact overlaps."""

import pickle
import sys
import types

from helpers import studies
from helpers.tiny_drive import tiny_scenario, write_scenario
import numpy as np
import pytest

from cns_drake.__main__ import main
from cns_drake.base.errors import InputError
from cns_drake.studies import pair_export
from cns_drake.studies.pair_export import (
    ExportOptions,
    Run,
    evaluation_sets,
    export_pairs,
    training_tuples,
)


def run_of(seed, number, city=0):
    X_WS = np.tile(np.eye(4), (number, 1, 1))
    X_WS[:, :2, 3] = np.random.default_rng(seed).uniform(0, 150, (number, 2))
    return Run(f"runs/{seed}", X_WS, city)


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


def drives(folder):
    lidar = {"preset": "vlp-16", "columns": 360}
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


def test_submaps_have_no_overlaps(tmp_path, monkeypatch, capsys):
    file = write_scenario(tiny_scenario(tmp_path), tmp_path)
    line = (
        f"cns-drake export-pairs {file} --format overlap --scans 2 --output x"
    )
    monkeypatch.setattr(sys, "argv", line.split())
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert "--scans: overlaps are those of single scans" in (
        capsys.readouterr().err
    )
