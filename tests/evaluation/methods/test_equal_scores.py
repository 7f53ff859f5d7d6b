"""Scores and poses have the same bits on every processor."""

import hashlib
import json
import subprocess
import sys

from helpers.processors import on_processor
import numpy as np
import pytest

from evaluation.methods import make_method

pytestmark = pytest.mark.slow

METHODS = ["ring++", "btc"]
# Numba keeps code for each kind of processor apart, and compiles all anew.
ANY = {"NUMBA_CPU_NAME": "generic"}


def town(seed, number=60):
    """Returns a ground with walls and posts around a sensor, (N, 3)."""
    rng = np.random.default_rng([seed, 77])
    ground = rng.uniform(-40.0, 40.0, (40000, 3))
    ground[:, 2] = rng.normal(-1.6, 0.01, 40000)
    parts = [ground]
    for _ in range(number):
        foot, size = rng.uniform(-38.0, 38.0, 2), rng.choice([0.1, 6.0])
        along = rng.uniform(-size, size, 250)
        x, y = rng.normal(size=2)
        length = np.sqrt(x * x + y * y)
        z = rng.uniform(-1.6, rng.uniform(2.0, 8.0), 250)
        parts.append(
            np.stack(
                [
                    foot[0] + along * x / length,
                    foot[1] + along * y / length,
                    z,
                ],
                axis=1,
            )
        )
    return np.concatenate(parts)


def seen_again(points, seed):
    """Returns the points, seen from elsewhere and with errors."""
    rng = np.random.default_rng([seed, 78])
    t = rng.uniform(-1.0, 1.0)
    c, s = (1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t)
    x, y, z = (points - [*rng.uniform(-4.0, 4.0, 2), 0.0]).T
    turned = np.stack([c * x + s * y, c * y - s * x, z], axis=1)
    return turned + rng.normal(0.0, 0.01, turned.shape)


def answers():
    """Returns the hash of the points, and of each method's results."""
    scans = [town(seed) for seed in range(3)]
    asked = [seen_again(scan, k) for k, scan in enumerate(scans)]
    found = {"points": digest([*scans, *asked])}
    for name in METHODS:
        method = make_method(name, {})
        places = [method.describe_place(scan) for scan in scans]
        database = method.build_database(places)
        results = []
        for scan in asked:
            query = method.describe(scan)
            scores = method.score(query, database)
            assert not np.isnan(scores).all()
            poses = method.relative_poses(query, database, range(len(scans)))
            results += [scores, *(X for X in poses if X is not None)]
        found[name] = digest(results)
    return found


def digest(arrays):
    content = hashlib.sha256()
    for array in arrays:
        content.update(np.ascontiguousarray(array).tobytes())
    return content.hexdigest()


@pytest.mark.parametrize(
    "loops", [{}, pytest.param(ANY, marks=pytest.mark.night)]
)
def test_answers_are_those_of_another_processor(loops):
    other = subprocess.run(
        [sys.executable, __file__],
        env=on_processor("oldest") | loops,
        check=True,
        capture_output=True,
        text=True,
    )
    assert json.loads(other.stdout) == answers()


if __name__ == "__main__":
    print(json.dumps(answers()))
