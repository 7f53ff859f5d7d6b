"""Sets for other trainers: pickles, positives, negatives."""

import pickle

import numpy as np

from cns_drake.training.pair_export import (
    ExportedDrive,
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


def line(name, number, city=0, start=0.0):
    X_WS = np.tile(np.eye(4), (number, 1, 1))
    X_WS[:, 0, 3] = start + 10.0 * np.arange(number)
    return ExportedDrive(f"runs/{name}", X_WS, city)


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
