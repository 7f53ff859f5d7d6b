"""How long a large import takes, and its memory.

    python tests/benchmarks/many_houses.py [--houses N] [--dressed]

An OpenStreetMap file of N detached houses in blocks between streets is written
and imported. Printed are the time by the clock, the processor time of all
processes, and the peak of resident memory of the largest of them.

Linux only.
"""

import argparse
import math
from pathlib import Path
import random
import resource
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(Path(__file__).parents[1]))
from helpers.small_osm import OsmWriter

# Distance of neighbouring houses, and houses of a block in each direction.
SPACING = 24.0
BLOCK = 5


def draw_town(houses: int) -> OsmWriter:
    """Returns houses at random, and the streets between their blocks."""
    town = OsmWriter()
    lot = random.Random(1)
    side = math.ceil(math.sqrt(houses))
    for number in range(houses):
        x, y = (SPACING * place for place in divmod(number, side))
        width, depth = lot.uniform(8.0, 14.0), lot.uniform(8.0, 13.0)
        levels = str(lot.randint(1, 3))
        tags = {"building": "house", "building:levels": levels}
        town.box(x, y, width, depth, **tags)
    lines = [SPACING * place - 5.0 for place in range(0, side + 1, BLOCK)]
    crossings = [[town.node(x, y) for y in lines] for x in lines]
    for street in [*crossings, *map(list, zip(*crossings, strict=True))]:
        town.way_of(street, highway="residential")
    return town


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--houses", type=int, default=10_000)
    parser.add_argument("--dressed", action="store_true")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "houses.osm")
        draw_town(arguments.houses).write(file)
        command = [sys.executable, "-m", "cns_drake", "import", str(file)]
        command += ["--output", str(Path(folder, "map"))]
        command += [] if arguments.dressed else ["--plain"]
        start = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        clock = time.perf_counter() - start
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(
        f"{arguments.houses} houses: {clock:.1f} s by the clock,"
        f" {used.ru_utime + used.ru_stime:.1f} s of processor time,"
        f" {used.ru_maxrss * 1024 / 1e6:.0f} MB"
    )


if __name__ == "__main__":
    main()
