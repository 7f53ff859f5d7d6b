"""Draws a campus, for `like_nclt.yaml`: OpenStreetMap's format, our own data.

    python docs/examples/campus.py SEED FOLDER

Writes `campus.osm` and `path.csv`, the waypoints of a drive of 2.8 km in two
loops over its footpaths. Seed and rules make everything. The sizes have their
sources beside them; NOT MEASURED marks a guess.
"""

from itertools import pairwise
from pathlib import Path
import sys

import numpy as np
import shapely
import shapely.affinity
from shapely.geometry import LineString, box

# Distance between two crossings of footpaths [m], and their displacement. NOT
# MEASURED: blocks of a campus are of the size of its buildings and lawns.
BLOCK = 70.0
JITTER = 12.0
# Width of a footpath [m]: paths that a service car may use are 3 to 4 m wide
# (AASHTO's guide for shared paths: at least 3.0 m, 3.6 to 4.3 m if busy).
WIDTH = 4.0
# Crossings of the first loop, in blocks. The second loop is its mirror image.
LOOP = (
    (3, 2), (3, 4), (0, 4), (0, 3), (2, 3), (2, 2), (0, 2), (0, 0), (1, 0),
    (1, 1), (2, 1), (2, 0), (3, 0), (3, 2),
)  # fmt: skip
# Number of blocks from west to east.
COLUMNS = 8
# Number of blocks from south to north.
ROWS = 5
# What stands in a block. NOT MEASURED: a third of the blocks is open.
SHARES = {"building": 0.55, "lawn": 0.30, "parking": 0.15}
# Length of a degree at latitude 0 [m]: the file lies where degrees are equal.
DEGREE = 111_319.49
SOUTH = 0.9933056  # Of a degree of latitude at the equator.


class File:
    """An OpenStreetMap file in the making."""

    def __init__(self):
        self.lines, self.ways, self.number = [], [], 0

    def node(self, x, y, **tags):
        self.number += 1
        self.lines.append(
            f'<node id="{self.number}" version="1" visible="true"'
            f' lat="{y / DEGREE / SOUTH:.9f}" lon="{x / DEGREE:.9f}">'
            f"{_text(tags)}</node>"
        )
        return self.number

    def way(self, points, **tags):
        points = [tuple(point) for point in points]
        ids = [self.node(*point) for point in dict.fromkeys(points)]
        if points[0] == points[-1]:
            ids.append(ids[0])
        self.number += 1
        nodes = "".join(f'<nd ref="{one}"/>' for one in ids)
        self.ways.append(
            f'<way id="{self.number}" version="1" visible="true">'
            f"{nodes}{_text(tags)}</way>"
        )

    def area(self, polygon, **tags):
        self.way(shapely.get_coordinates(polygon.exterior), **tags)

    def save(self, path):
        text = "\n".join([*self.lines, *self.ways])
        path.write_text(
            f'<osm version="0.6" generator="campus.py">\n{text}\n</osm>\n'
        )


def _text(tags):
    return "".join(
        f'<tag k="{name}" v="{value}"/>' for name, value in tags.items()
    )


def crossings(rng):
    """Returns the places of the crossings, (COLUMNS, ROWS, 2) [m]."""
    columns, rows = np.mgrid[:COLUMNS, :ROWS].astype(float)
    columns -= (COLUMNS - 1) / 2
    rows -= (ROWS - 1) / 2
    places = BLOCK * np.stack([columns, rows], axis=-1)
    return places + rng.uniform(-JITTER, JITTER, places.shape)


def loops(places):
    """Returns both loops as polylines, each from its crossing to itself."""
    first = [places[c, r] for c, r in along(LOOP)]
    second = [places[COLUMNS - 1 - c, r] for c, r in along(LOOP)]
    return np.array(first), np.array(second)


def along(corners):
    """Yields each crossing on the way between corners."""
    yield corners[0]
    for (c, r), (to_c, to_r) in pairwise(corners):
        steps = abs(to_c - c) + abs(to_r - r)
        for k in range(1, steps + 1):
            yield (
                c + (to_c - c) * k // steps,
                r + (to_r - r) * k // steps,
            )


def draw(seed, folder):
    rng = np.random.default_rng(seed)
    places = crossings(rng)
    file = File()
    paths = []
    for c in range(COLUMNS):
        for r in range(ROWS):
            for to in ((c + 1, r), (c, r + 1)):
                if to[0] < COLUMNS and to[1] < ROWS:
                    paths.append(LineString([places[c, r], places[to]]))
    for path in paths:
        file.way(path.coords, highway="footway", width=WIDTH)
        furnish(file, path, rng)
    clear = shapely.union_all([path.buffer(WIDTH / 2 + 2) for path in paths])
    for c in range(COLUMNS - 1):
        for r in range(ROWS - 1):
            corners = places[[c, c + 1, c + 1, c], [r, r, r + 1, r + 1]]
            block = shapely.Polygon(corners).difference(clear)
            kind = rng.choice(list(SHARES), p=list(SHARES.values()))
            fill(file, block, kind, rng)
    # A street runs round the campus, and footpaths end at it.
    x, y = BLOCK * COLUMNS / 2 + 5.0, BLOCK * ROWS / 2 + 5.0
    file.way(box(-x, -y, x, y).exterior.coords, highway="residential")
    # The middle of the buildings is the origin of the map: huts at the corners.
    for sx in (-x - 15.0, x + 15.0):
        for sy in (-y - 15.0, y + 15.0):
            hut = box(sx - 1.5, sy - 1.5, sx + 1.5, sy + 1.5)
            file.area(hut, building="hut")
    folder.mkdir(parents=True, exist_ok=True)
    file.save(folder / "campus.osm")
    first, second = loops(places)
    rows = [f"{x:.3f},{y:.3f}" for x, y in np.concatenate([first, second])]
    (folder / "path.csv").write_text("\n".join(["x,y", *rows, ""]))


def furnish(file, path, rng):
    """Puts lamps, benches and trees beside a footpath."""
    side = path.offset_curve(rng.choice([-1, 1]) * (WIDTH / 2 + 1.2))
    for s in np.arange(12.0, side.length - 6.0, 28.0):
        file.node(*side.interpolate(s).coords[0], highway="street_lamp")
    if rng.random() < 0.3:
        spot = side.interpolate(rng.uniform(0.3, 0.7), normalized=True)
        file.node(*spot.coords[0], amenity="bench")
    if rng.random() < 0.4:
        row = path.offset_curve(rng.choice([-1, 1]) * (WIDTH / 2 + 3.5))
        for s in np.arange(8.0, row.length - 6.0, rng.uniform(8.0, 14.0)):
            x, y = row.interpolate(s).coords[0]
            tree(file, x, y, rng)


def tree(file, x, y, rng):
    # A quarter of Michigan's planted trees has needles. NOT MEASURED here.
    kind = "needleleaved" if rng.random() < 0.25 else "broadleaved"
    height = f"{rng.uniform(6.0, 16.0):.1f}"
    file.node(x, y, natural="tree", leaf_type=kind, height=height)


def fill(file, block, kind, rng):
    """Puts a building, a lawn with trees, or a car park into a block."""
    x, y = shapely.get_coordinates(block.centroid)[0]
    if kind == "building":
        half = rng.uniform(9.0, 22.0), rng.uniform(9.0, 20.0)
        plan = box(x - half[0], y - half[1], x + half[0], y + half[1])
        if rng.random() < 0.5:
            # A wing is missing.
            part = box(x, y, x + half[0], y + half[1])
            plan = plan.difference(part)
        plan = shapely.affinity.rotate(plan, rng.normal(0.0, 6.0), "centroid")
        plan = plan.intersection(block.buffer(-1.0))
        levels = rng.integers(2, 6)
        if plan.geom_type == "Polygon":
            file.area(
                plan, **{"building": "university", "building:levels": levels}
            )
        ring = plan.buffer(2.5).exterior
        for _ in range(rng.integers(1, 4)):
            spot = ring.interpolate(rng.uniform(), normalized=True)
            if block.contains(spot):
                file.node(*spot.coords[0], amenity="bicycle_parking")
        free = block.difference(plan.buffer(5.0))
        count = rng.integers(0, 5)
    elif kind == "parking":
        lot = box(x - 16.0, y - 14.0, x + 16.0, y + 14.0).intersection(block)
        file.area(lot, amenity="parking")
        free, count = block.difference(lot.buffer(2.0)), rng.integers(2, 6)
    else:
        file.area(block, landuse="grass")
        free, count = block, rng.integers(4, 14)
    low_x, low_y, high_x, high_y = block.bounds
    for _ in range(count):
        spot = rng.uniform(low_x, high_x), rng.uniform(low_y, high_y)
        if free.contains(shapely.Point(spot)):
            tree(file, *spot, rng)


if __name__ == "__main__":
    draw(int(sys.argv[1]), Path(sys.argv[2]))
