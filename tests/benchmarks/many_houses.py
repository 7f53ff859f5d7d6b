"""How long a large import takes, and its memory.

    python tests/benchmarks/many_houses.py [--houses N] [--dressed]

An OpenStreetMap file of N detached houses in blocks between streets is written
and imported. Printed are the time by the clock, the processor time of all
processes, and the peak of resident memory of the largest of them.

Linux only.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
import random
import resource
import subprocess
import sys
import tempfile
import time

# Distance of neighbouring houses, and houses of a block in each direction.
SPACING = 24.0
BLOCK = 5
# Where the first house stands [deg].
LATITUDE = 52.0
LONGITUDE = 13.0
METRES_PER_DEG = 111_195.0


class OsmFile:
    """The elements of an OpenStreetMap file."""

    def __init__(self) -> None:
        self.nodes: list[str] = []
        self.ways: list[str] = []

    def add_node(self, x: float, y: float) -> int:
        """Adds a place, east and north of the first house [m]."""
        latitude = LATITUDE + y / METRES_PER_DEG
        east = METRES_PER_DEG * math.cos(math.radians(LATITUDE))
        number = len(self.nodes) + 1
        self.nodes.append(
            f'<node id="{number}" version="1" lat="{latitude:.8f}"'
            f' lon="{LONGITUDE + x / east:.8f}"/>'
        )
        return number

    def add_way(self, nodes: list[int], **tags: str) -> None:
        parts = [f'<nd ref="{node}"/>' for node in nodes]
        parts += [f'<tag k="{k}" v="{v}"/>' for k, v in tags.items()]
        number = len(self.ways) + 1
        self.ways.append(f'<way id="{number}">{"".join(parts)}</way>')

    def write(self, path: Path) -> None:
        body = "\n".join(self.nodes + self.ways)
        path.write_text(f'<osm version="0.6">{body}</osm>')


def draw_town(houses: int) -> OsmFile:
    """Returns houses at random, and the streets between their blocks."""
    town = OsmFile()
    lot = random.Random(1)
    side = math.ceil(math.sqrt(houses))
    for number in range(houses):
        x, y = (SPACING * place for place in divmod(number, side))
        width, depth = lot.uniform(8.0, 14.0), lot.uniform(8.0, 13.0)
        corners = [
            town.add_node(x + width * right, y + depth * up)
            for right, up in ((0, 0), (1, 0), (1, 1), (0, 1))
        ]
        levels = {"building:levels": str(lot.randint(1, 3))}
        town.add_way([*corners, corners[0]], building="house", **levels)
    lines = [SPACING * place - 5.0 for place in range(0, side + 1, BLOCK)]
    crossings = [[town.add_node(x, y) for y in lines] for x in lines]
    for street in [*crossings, *map(list, zip(*crossings, strict=True))]:
        town.add_way(street, highway="residential")
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
