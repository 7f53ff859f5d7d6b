"""Imported towns have the same bytes on every processor, and in every order.

Where streets look the same from several sides, no last bit decides.
"""

from functools import cache
import hashlib
import json
from pathlib import Path
import subprocess
import sys

from helpers.internal.studies import leave_figures_unrendered
from helpers.processors import on_processor, processors
from helpers.small_cityjson import CityWriter
from helpers.small_osm import OsmWriter
import numpy as np
import pytest

from worlds.imports import ImportOptions, import_city

pytestmark = pytest.mark.slow

# Distance from place to place in a regular town [m].
PITCH = 52.0


def town(seed):
    """Returns places (N, 2) of a town, their turns [deg], and its streets.

    Every third one is a grid, a honeycomb and a ring; every second one has
    equal distances. It may be turned or mirrored.
    """
    rng = np.random.default_rng([seed, 139])
    spread = 8.0 * (seed % 2)
    turns = np.zeros(20)
    if seed % 3 == 0:
        x, y = (
            np.arange(n) * PITCH + rng.uniform(0.0, spread, n)
            for n in rng.integers(2, 5, 2)
        )
        places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    elif seed % 3 == 1:
        q, r = np.meshgrid(np.arange(-2, 3), np.arange(-2, 3))
        places = np.stack([q + r / 2, r * np.sqrt(0.75)], axis=-1)
        places = PITCH * places[np.abs(q + r) <= 1 + seed // 3 % 2]
        places += rng.uniform(0.0, spread, places.shape)
    else:
        number = int(rng.integers(5, 13))
        turns = 360.0 / number * np.arange(number)
        angles = np.radians(turns) + rng.uniform(0.0, spread, number) / 100
        places = np.column_stack([np.cos(angles), np.sin(angles)])
        places = np.append(places * PITCH * number / 6.2, [[0, 0]], axis=0)
    apart = np.linalg.norm(places[:, None] - places, axis=2)
    streets = np.argwhere(np.triu(apart < 1.3 * PITCH, 1)).tolist()
    if seed % 3 == 2:  # The spokes.
        streets += [[k, number] for k in range(number)]
    turn = rng.choice([0.0, 30.0, 37.0, 45.0, 90.0])
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    places = places * [rng.choice([-1, 1]), 1] @ np.array([[c, s], [-s, c]])
    return places, np.resize(turns, len(places)) + turn, streets


def write_town(folder, seed, order):
    """Writes a town of houses or of streets; returns the file."""
    places, turns, streets = town(seed)
    if seed % 4 < 2:
        city = CityWriter()
        plain = city.vertex
        for k in np.arange(len(places))[::order].tolist():
            c, s = np.cos(np.radians(turns[k])), np.sin(np.radians(turns[k]))

            def vertex(x, y, z, at=places[k], c=c, s=s):
                return plain(at[0] + c * x - s * y, at[1] + s * x + c * y, z)

            city.vertex = vertex
            city.box(f"house_{k:02d}", -20.0, -20.0, (40.0, 40.0, 9.0))
        return city.write(folder / "town.city.json")
    osm = OsmWriter()
    nodes = [osm.node(*place) for place in places.tolist()]
    for a, b in streets[::order]:
        osm.way_of([nodes[a], nodes[b]], highway="residential", width="8")
    osm.box(*(places[0] + 8.0).tolist(), 12.0, 9.0, building="yes")
    return osm.write(folder / "town.osm")


def digests(folder, seeds, order=1):
    """Returns the name of each file of the towns -> its digest."""
    found = {}
    for seed in seeds:
        here = folder / f"{seed}"
        here.mkdir(parents=True)
        source = write_town(here, seed, order)
        import_city(source, here / "town", ImportOptions(dressed=False))
        for path in sorted((here / "town").rglob("*")):
            if path.is_file():
                name = path.relative_to(folder).as_posix()
                found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def routes(found):
    return {name: one for name, one in found.items() if "route_" in name}


@pytest.fixture(scope="module")
def towns(tmp_path_factory):
    """Returns a function: number of towns -> their digests."""
    return cache(lambda n: digests(tmp_path_factory.mktemp("towns"), range(n)))


@pytest.mark.parametrize(
    ("number", "processor"),
    [
        (4, "oldest"),
        *(
            pytest.param(48, one, marks=pytest.mark.night)
            for one in processors()
        ),
    ],
)
def test_towns_are_those_of_another_processor(
    number, processor, towns, tmp_path
):
    other = subprocess.run(
        [sys.executable, __file__, str(tmp_path), str(number)],
        env=on_processor(processor),
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    assert json.loads(other.stdout.splitlines()[-1]) == towns(number)
    assert len(routes(towns(number))) > number


@pytest.mark.parametrize(
    "number", [4, pytest.param(48, marks=pytest.mark.night)]
)
def test_the_order_of_a_file_decides_nothing(number, towns, tmp_path):
    back = digests(tmp_path, range(number), order=-1)
    assert routes(back) == routes(towns(number))


if __name__ == "__main__":
    folder, number = sys.argv[1:]
    with pytest.MonkeyPatch.context() as patch:
        leave_figures_unrendered(patch)
        print(json.dumps(digests(Path(folder), range(int(number)))))
